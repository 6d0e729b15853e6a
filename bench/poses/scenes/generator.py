# SPDX-License-Identifier: BSD-3-Clause
# A diesel generator on a trailer: louvred canopy, open side with the engine, an exhaust at 330 C, a road barrier fence, trees and a shed;
# a thermal camera of 320x240 and one part far hotter than all else. For ../shared/scenes/render_orbit.py.
gravel=M('gravel',(.4,.38,.35),.95,temp=12,noise=(9,(.25,.24,.22),(.55,.53,.5))); ground(gravel)
green=M('green',(.06,.28,.12),.35,temp=16,noise=(1.2,(.05,.24,.1),(.08,.33,.15)),temp_fn=[[.9,0,1.3,.5,9.0]]); dark=M('dark',(.05,.05,.055),.6,temp=13); tyre=M('tyre',(.03,.03,.03),.9,temp=12)
steel=M('steel',(.45,.45,.45),.35,.8,temp=12); grille=M('grille',(.1,.1,.1),.7,temp=34); block=M('block',(.3,.32,.34),.5,.3,temp=82,noise=(6,(.2,.22,.24),(.4,.42,.45))); exhaust=M('exhaust',(.28,.2,.16),.6,.6,temp=330); manifold=M('manifold',(.3,.22,.18),.6,.5,temp=240)
panel=M('panel',(.8,.8,.78),.4,temp=19); copper=M('copper',(.7,.35,.2),.4,.8,temp=46); decal=M('decal',(.06,.28,.12),.4,temp=16,decal=image_tex('gendecal',256,256,lambda w,h: random_decal(w,h,(.1,.33,.16),16,random.Random(31))))
box((0,0,.55),(3.2,1.5,.16),dark); box((-.2,0,1.95),(2.8,1.4,.12),green,bevel=.04); box((-.2,.68,1.27),(2.8,.05,1.3),green,bevel=.01); box((1.18,0,1.27),(.06,1.4,1.3),grille); box((-1.58,0,1.27),(.06,1.4,1.3),green)
box((-.9,-.68,1.27),(1.3,.05,1.3),decal); box((-.9,-.72,1.35),(.5,.03,.4),panel)
for k in range(9): box((1.23,0,.75+.12*k),(.04,1.3,.03),dark,rot=(0,.5,0))
for k in range(8): box((-.2+.13*k,.72,1.2),(.04,.03,.7),dark)
box((.45,-.05,1.0),(1.1,.6,.65),block,bevel=.05); cyl((-.5,-.05,1.0),.32,.7,M('alternator',(.2,.3,.5),.5,.2,temp=58),rot=(0,math.pi/2,0))
for k in range(4): cyl((.1+.22*k,-.42,1.2),.05,.16,manifold,rot=(math.pi/2,0,0),v=20)
cyl((.43,-.5,1.2),.05,.9,manifold,rot=(0,math.pi/2,0),v=20); cyl((.85,-.3,1.75),.05,1.0,exhaust,v=24); cyl((.85,-.3,2.3),.09,.45,exhaust,v=28); cyl((.85,-.3,2.6),.045,.2,exhaust,v=20,)
for s in (-1,1):
    cyl((0,s*.9,.36),.36,.24,tyre,rot=(math.pi/2,0,0),v=56,bevel=.04); cyl((0,s*1.03,.36),.18,.02,steel,rot=(math.pi/2,0,0)); box((0,s*.95,.78),(.95,.3,.04),dark)
box((2.15,0,.5),(1.4,.1,.1),dark); cyl((2.8,0,.28),.05,.5,steel); cyl((2.8,0,.1),.14,.08,tyre,rot=(math.pi/2,0,0))
for i in range(3):
    for k in range(10): cyl((-1.75-.02*k*k,-.3+.3*i,.95-.085*k),.035,.14,copper if i==1 else dark,rot=(0,.5+.1*k,0),v=12)
for k in range(14):
    a=k*2*math.pi/14; x,y=5.2*math.cos(a),5.2*math.sin(a)
    if k in (2,3,9): continue
    box((x,y,.8),(.05,1.8,.12),M('rail%d'%k,(.8,.1,.05) if k%2 else (.85,.85,.85),.6,temp=10+k%3),rot=(0,0,a)); box((x,y,.45),(.05,.07,.9),steel,rot=(0,0,a))
for k in range(9):
    a=rng.uniform(0,6.28); r=rng.uniform(8,12); x,y=r*math.cos(a),r*math.sin(a); cyl((x,y,1.3),.16,2.6,M('trunk%d'%k,(.25,.17,.1),.9,temp=11),v=12)
    for j in range(5):
        bpy.ops.mesh.primitive_ico_sphere_add(radius=rng.uniform(.6,1.1),location=(x+rng.uniform(-.8,.8),y+rng.uniform(-.8,.8),rng.uniform(2.4,3.8)),subdivisions=3); obj(bpy.context.object,M('leaf%d_%d'%(k,j),(.1,.25,.06),.9,temp=9+rng.uniform(-1,2),noise=(14,(.05,.14,.03),(.2,.38,.12))))
surroundings(4.5,15,5,40)
CONFIG=dict(target=(0,0,1.1),vis_r=4.6,ir_r=6.4,ir_hfov=36,vis_hfov=62,vis_el=(10,32),ir_el=(8,26),irres=(320,240),sky=-20.0,sun=210.0)
