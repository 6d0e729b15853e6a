# SPDX-License-Identifier: BSD-3-Clause
# Indoors: a stainless vessel with pipes on a skid, in a room whose walls repeat the same pillars and panels. Near
# background, repeated structure, gloss. For ../shared/scenes/render_orbit.py, as the other scenes of this folder.
floor=M('floor',(.3,.3,.3),.7,temp=19,noise=(5,(.2,.2,.19),(.42,.41,.38))); ground(floor,18)
wall=M('wall',(.6,.62,.58),.9,temp=18.5,noise=(1.6,(.5,.53,.5),(.68,.69,.62))); pillar=M('pillar',(.55,.3,.12),.8,temp=20,noise=(3,(.45,.22,.08),(.62,.36,.16)))
panel=M('panel',(.2,.3,.42),.6,temp=21); lamp=M('lamp',(.9,.9,.8),.4,temp=26)
steel=M('steel',(.62,.63,.65),.22,.9,temp=24,temp_fn=[[.3,-.5,.9,.35,30.0],[-.4,.4,1.5,.3,-8.0]])
clad=M('clad',(.75,.74,.7),.35,.3,temp=31,noise=(9,(.62,.61,.57),(.82,.81,.77))); red=M('red',(.5,.06,.04),.4,temp=22)
hot=M('hot',(.5,.42,.3),.5,.4,temp=58); warm=M('warm',(.2,.22,.25),.5,.6,temp=38); board=M('board',(.1,.12,.1),.6,temp=27)
half=7.0
for k in range(4):
    c,s=math.cos(k*math.pi/2),math.sin(k*math.pi/2)
    box((half*c,half*s,2),(.2,2*half,4),wall,rot=(0,0,k*math.pi/2))
    for i in range(7):
        t=-half+1+i*2; x,y=(half-.25)*c-t*s,(half-.25)*s+t*c
        box((x,y,2),(.4,.4,4),pillar,rot=(0,0,k*math.pi/2))
        if i<6: t+=1; box(((half-.13)*c-t*s,(half-.13)*s+t*c,1.4),(.08,1.2,1.6),panel,rot=(0,0,k*math.pi/2))
box((0,0,.08),(2.4,1.5,.16),red); box((0,0,.2),(2.2,1.3,.08),warm)
cyl((-.35,0,1.1),.48,1.5,steel); cyl((-.35,0,1.88),.36,.12,steel); cyl((-.35,0,2.0),.1,.2,hot)
cyl((.65,.25,.62),.3,.9,clad,rot=(0,math.pi/2,0)); cyl((.65,-.4,.45),.17,.7,warm,rot=(math.pi/2,0,0)); cyl((.65,-.85,.45),.2,.25,hot,rot=(math.pi/2,0,0))
for z,m in ((.55,hot),(1.0,clad),(1.45,hot)):
    cyl((.15,-.3,z),.05,.9,m,rot=(0,math.pi/2,0)); cyl((.6,-.3,z-.15),.05,.35,m); cyl((.1,-.3,z),.09,.05,red,rot=(0,math.pi/2,0))
cyl((-1.0,.45,.7),.06,1.2,hot); cyl((-.7,.45,1.3),.06,.6,hot,rot=(0,math.pi/2,0)); box((-1.0,-.5,.75),(.3,.2,1.0),board,bevel=.02); box((-1.0,-.61,1.0),(.18,.02,.2),lamp)
box((1.0,.6,1.25),(.2,.14,.35),board); cyl((1.0,.6,.7),.03,.9,warm)
for i in range(10):
    a=rng.uniform(0,6.28); r=rng.uniform(1.9,2.6); s=rng.uniform(.1,.3)
    box((r*math.cos(a),r*math.sin(a),s/2),(s,s*rng.uniform(.6,1.5),s),M('crate%d'%i,(rng.random()*.6,rng.random()*.5,rng.random()*.4),.9,temp=19+rng.uniform(-1,2),noise=(12,(rng.random()*.4,.2,.1),(.5,.4,.3))),rot=(0,0,rng.uniform(0,3)))
CONFIG=dict(target=(0,0,.9),vis_r=3.9,ir_r=5.4,ir_hfov=30,vis_hfov=62,vis_el=(12,34),ir_el=(8,28),sky=17.0,sun=120.0)
