# SPDX-License-Identifier: BSD-3-Clause
# Outdoors on a slope: an air-cooled chiller on a gravel bank that falls by four degrees, a house's wall on one side,
# trees and a hedge that break the horizon on the others. For ../shared/scenes/render_orbit.py, as the other scenes here.
gravel=M('gravel',(.4,.38,.34),.95,temp=16,noise=(7,(.25,.23,.2),(.55,.52,.47)))
bpy.ops.mesh.primitive_plane_add(size=70,location=(0,0,0),rotation=(math.radians(4),0,0)); obj(bpy.context.object,gravel)
plaster=M('plaster',(.75,.7,.58),.9,temp=21,noise=(1.2,(.68,.62,.5),(.82,.78,.66))); pane=M('pane',(.04,.05,.07),.08,temp=12); frame=M('frame',(.8,.8,.78),.5,temp=19)
box((0,7.5,2.6),(16,.5,6.5),plaster)
for x in (-5.2,-1.9,1.2,4.6): box((x,7.22,2.6),(1.3,.08,1.5),frame); box((x,7.17,2.6),(1.1,.06,1.3),pane)
bark=M('bark',(.16,.11,.07),.95,temp=15); leaf=[M('leaf%d'%k,(.06,.16+.03*k,.04),.9,temp=13+k,noise=(9,(.02,.07,.02),(.14,.3,.08))) for k in range(3)]
def ball(loc,r,m):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2,radius=r,location=loc); obj(bpy.context.object,m)
for k in range(7):
    a=math.radians(-200+k*33+rng.uniform(-8,8)); r=rng.uniform(9,14); x,y=r*math.cos(a),r*math.sin(a); g=math.tan(math.radians(4))*y; h=rng.uniform(1.6,2.6)
    cyl((x,y,g+h/2),.16,h+.4,bark)
    for i in range(22): ball((x+rng.gauss(0,.75),y+rng.gauss(0,.75),g+h+.5+rng.gauss(0,.6)),rng.uniform(.25,.6),leaf[i%3])
for i in range(26): ball((-7.5+rng.gauss(0,.2),-5+i*.4,-.35+.05*i*.4+.4+rng.gauss(0,.12)),rng.uniform(.35,.6),leaf[i%3])
slab=M('slab',(.6,.6,.58),.9,temp=17,noise=(6,(.5,.5,.48),(.68,.68,.66))); box((0,0,.02),(3.3,1.9,.3),slab,bevel=.02)
case=M('case',(.66,.68,.66),.45,.2,temp=22,temp_fn=[[.9,-.6,.8,.4,6.0]],noise=(14,(.6,.62,.6),(.7,.72,.7))); fin=M('fin',(.2,.21,.22),.6,.5,temp=36); dark=M('dark',(.04,.04,.05),.5,temp=30)
box((0,0,.95),(2.6,1.2,1.3),case,bevel=.03)
for s in (-1,1):
    box((-.3,s*.61,1.0),(1.7,.03,1.0),fin)
    for i in range(17): box((-1.1+i*.1,s*.63,1.0),(.03,.03,1.0),dark)
for x in (-.85,0,.85): cyl((x,0,1.66),.38,.14,dark); cyl((x,0,1.74),.3,.03,fin); box((x,0,1.77),(.7,.05,.03),case); box((x,0,1.77),(.05,.7,.03),case)
hot=M('hot',(.5,.42,.3),.5,.4,temp=55); cold=M('cold',(.1,.1,.12),.7,temp=7); red=M('red',(.55,.05,.04),.5,temp=20)
cyl((1.5,.3,.5),.06,.9,hot,rot=(0,math.pi/2,0)); cyl((1.5,-.3,.5),.09,.9,cold,rot=(0,math.pi/2,0)); cyl((1.95,.3,.3),.06,.5,hot); cyl((1.95,-.3,.3),.09,.5,cold)
box((1.31,0,1.15),(.05,.5,.6),red,bevel=.01); box((1.35,.05,1.25),(.03,.2,.15),dark); box((-1.36,.2,.8),(.14,.5,.7),M('board',(.55,.56,.5),.5,temp=31),bevel=.02)
for i in range(4): cyl((.8-.12*i,-.75,.28),.05,.25,red)
for i in range(16):
    a=rng.uniform(0,6.28); r=rng.uniform(2.2,4.2); s=rng.uniform(.06,.22); x,y=r*math.cos(a),r*math.sin(a)
    box((x,y,math.tan(math.radians(4))*y+s/3),(s*rng.uniform(.6,2),s*rng.uniform(.6,2),s),M('rock%d'%i,(rng.random()*.5,rng.random()*.5,rng.random()*.5),.9,temp=15+rng.uniform(-1,4)),rot=(0,0,rng.uniform(0,3)))
CONFIG=dict(target=(0,0,.85),vis_r=4.2,ir_r=6.2,ir_hfov=30,vis_hfov=62,vis_el=(13,36),ir_el=(9,30),sky=-22.0,sun=140.0)
