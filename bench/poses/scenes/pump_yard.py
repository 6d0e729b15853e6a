# SPDX-License-Identifier: BSD-3-Clause
# A glossy pump with motor in a walled yard: brick walls with equal pillars close behind it.
paving=M('paving',(.35,.34,.32),.9,temp=14,noise=(4,(.24,.23,.22),(.45,.44,.4))); ground(paving,30)
brick=M('bricks',(.38,.16,.1),.85,temp=12,noise=(6,(.25,.09,.06),(.52,.27,.19))); stone=M('stone',(.6,.58,.52),.9,temp=10.5)
blue=M('blue',(.03,.12,.4),.15,.1,temp=34,temp_fn=[[.7,0,.6,.3,22.0]]); steel=M('steel',(.65,.66,.68),.2,.95,temp=18); white=M('white',(.82,.82,.8),.12,0,temp=25,temp_fn=[[-.8,.2,.9,.3,12.0]])
dark=M('dark',(.05,.05,.06),.4,temp=20); hot=M('hot',(.5,.3,.2),.5,.3,temp=63); plinth=M('plinth',(.5,.5,.48),.9,temp=13,noise=(8,(.4,.4,.38),(.58,.57,.54)))
h=5.2
for k in range(4):
    c,s=math.cos(k*math.pi/2),math.sin(k*math.pi/2)
    box((h*1.5*c,h*1.5*s,1.2),(.25,3*h,2.4),brick,rot=(0,0,k*math.pi/2))
    for i in range(9):
        t=-1.5*h+.6+i*(3*h-1.2)/8; box((1.46*h*c-t*s,1.46*h*s+t*c,1.35),(.35,.35,2.7),stone,rot=(0,0,k*math.pi/2))
box((0,0,.15),(3.0,1.3,.3),plinth,bevel=.03)
cyl((.7,0,.75),.36,1.0,blue,rot=(0,math.pi/2,0),bevel=.05)
for i in range(9): box((.35+i*.09,0,.75),(.03,.82,.6),blue)
box((.75,0,1.18),(.35,.3,.2),dark,bevel=.03); cyl((.05,0,.75),.08,.4,steel,rot=(0,math.pi/2,0)); box((.05,0,.75),(.25,.4,.35),dark)
cyl((-.65,0,.8),.5,.35,white,rot=(0,math.pi/2,0),bevel=.06); cyl((-.65,0,1.55),.16,1.0,white); cyl((-.65,0,2.05),.24,.06,steel); cyl((-1.25,0,.8),.18,.9,hot,rot=(0,math.pi/2,0)); cyl((-1.68,0,.8),.27,.06,steel,rot=(0,math.pi/2,0))
for i in range(8):
    a=i*math.pi/4; cyl((-.65+.2*math.cos(a),.2*math.sin(a),2.1),.02,.08,dark)
box((-.2,.75,.9),(.5,.18,1.1),M('cabinet',(.55,.56,.5),.5,temp=22),bevel=.02); box((-.2,.85,1.1),(.2,.02,.3),M('display',(.02,.03,.03),.1,temp=28)); cyl((1.2,-.55,.6),.05,.7,hot); cyl((.95,-.55,.9),.05,.5,hot,rot=(0,math.pi/2,0))
for i in range(14):
    a=rng.uniform(0,6.28); r=rng.uniform(2.2,4.0); s=rng.uniform(.06,.2)
    box((r*math.cos(a),r*math.sin(a),s/2),(s*rng.uniform(.6,2),s*rng.uniform(.6,2),s),M('rock%d'%i,(rng.random()*.5,rng.random()*.5,rng.random()*.5),.9,temp=14+rng.uniform(-1,3)),rot=(0,0,rng.uniform(0,3)))
CONFIG=dict(target=(-.1,0,.8),vis_r=3.9,ir_r=6.0,ir_hfov=27,vis_hfov=60,vis_el=(14,38),ir_el=(10,32),sky=-12.0,sun=210.0)
