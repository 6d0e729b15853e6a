# SPDX-License-Identifier: BSD-3-Clause
# A forklift on the smooth floor of a hall with plain walls and racks: thin forks and a mast that one sees through, little
# texture near it, a thermal camera of 160x120 with a wide lens. For ../shared/scenes/render_orbit.py.
floor=M('floor',(.35,.35,.34),.45,temp=17,noise=(.9,(.31,.31,.3),(.38,.38,.37))); ground(floor,44)
line=M('line',(.75,.6,.08),.6,temp=17.3); wall=M('wall',(.7,.7,.68),.9,temp=16,noise=(.5,(.66,.66,.64),(.74,.74,.72)))
rack=M('rack',(.1,.2,.45),.5,temp=16.5); yellow=M('yellow',(.85,.5,.03),.3,temp=19,decal=image_tex('plate',256,256,lambda w,h: random_decal(w,h,(.85,.5,.03),14,random.Random(5))))
black=M('black',(.03,.03,.035),.5,temp=20); tyre=M('tyre',(.02,.02,.02),.9,temp=27); steel=M('steel',(.5,.5,.52),.25,.9,temp=18)
chain=M('chain',(.3,.28,.25),.4,.7,temp=29); engine=M('engine',(.2,.2,.2),.6,temp=46,temp_fn=[[-.9,.2,.6,.25,22.0]]); exhaust=M('exhaust',(.4,.33,.28),.5,.6,temp=74)
seat=M('seat',(.1,.1,.12),.8,temp=30); pallet=M('pallet',(.5,.36,.2),.9,temp=16.5,noise=(8,(.35,.24,.12),(.6,.45,.27)))
for y in (-4.0,4.0): box((0,y,.004),(30,.12,.008),line)
for x in (-5.0,5.0): box((x,0,.004),(.12,8,.008),line)
for k in range(4):
    c,s=math.cos(k*math.pi/2),math.sin(k*math.pi/2); box((15*c,15*s,3.5),(.3,30,7),wall,rot=(0,0,k*math.pi/2))
for side in (-1,1):
    for i in range(9):
        x=-12+3*i; box((x,side*12,2.5),(.12,.9,5),rack)
        for z in (1.4,3.0,4.6):
            if i<8: box((x+1.5,side*12,z),(3,.9,.1),rack)
        for z in (0,1.45,3.05):
            if i<8 and rng.random()<.6: h=rng.uniform(.6,1.2); box((x+1.5,side*12,z+h/2),(rng.uniform(1.2,2.4),.8,h),M('goods%d%d%d'%(side,i,int(z*10)),(rng.random()*.6,rng.random()*.5,rng.random()*.4),.9,temp=16+rng.uniform(-1,2),noise=(6,(rng.random()*.4,.2,.1),(.5,.4,.3))))
# Body, counterweight, cabin and mast; the forks point along +x.
box((-.35,0,.62),(1.5,.95,.5),yellow,bevel=.05); box((-1.15,0,.75),(.45,1.0,.8),yellow,bevel=.12); box((-.8,0,.93),(.7,.8,.2),engine,bevel=.03)
for x in (.45,-.9):
    for y in (-.48,.48): cyl((x,y,.32),.32,.24,tyre,rot=(math.pi/2,0,0)); cyl((x,y*1.28,.32),.14,.03,steel,rot=(math.pi/2,0,0))
box((-.35,0,1.02),(.5,.5,.16),seat,bevel=.04); box((-.6,0,1.3),(.12,.5,.5),seat,bevel=.04)
for x,t in ((.3,-.12),(-.95,.05)):
    for y in (-.42,.42): cyl((x,y,1.5),.03,1.25,black,rot=(0,t,0))
for y in (-.42,-.21,0,.21,.42): box((-.33,y,2.12),(1.35,.04,.05),black)
cyl((-1.28,-.3,1.5),.05,.75,exhaust); cyl((.12,.15,1.25),.02,.5,steel,rot=(0,.5,0)); cyl((.02,.15,1.47),.16,.03,black,rot=(0,.5,0))
for y in (-.33,-.2,.2,.33): box((.78,y,1.35),(.09,.07,2.5),black)
for z in (.25,1.3,2.55): box((.78,0,z),(.08,.72,.08),black)
for y in (-.08,.08): cyl((.76,y,1.4),.018,2.2,chain)
cyl((.74,0,1.1),.05,1.7,steel); box((.87,0,.55),(.05,.95,.5),steel)
for y in (-.27,.27): box((1.45,y,.24),(1.15,.12,.045),steel); box((.9,y,.4),(.05,.12,.35),steel)
for dx in (-.45,0,.45):
    box((1.5+dx,0,.36),(.12,1.1,.1),pallet); box((1.5+dx,0,.14),(.12,1.1,.1),pallet)
for i in range(7): box((1.5,-.5+i*.167,.43),(1.1,.1,.03),pallet)
box((1.5,0,.7),(.9,.8,.5),M('load',(.45,.34,.22),.9,temp=23,noise=(14,(.3,.22,.13),(.6,.46,.3))))
CONFIG=dict(target=(.2,0,.9),vis_r=4.6,ir_r=4.9,ir_hfov=50,vis_hfov=60,vis_el=(12,36),ir_el=(9,30),irres=(160,120),sky=12.0,sun=200.0)
