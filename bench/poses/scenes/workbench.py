# SPDX-License-Identifier: BSD-3-Clause
# A small thing from near: an open power supply of half a metre on a bench in a workshop, hot chips and coils, cold bench;
# a thermal camera of 240x180 at 1.1 m. For ../shared/scenes/render_orbit.py.
floor=M('floor',(.35,.35,.36),.8,temp=20,noise=(3,(.25,.25,.27),(.45,.45,.46))); ground(floor)
wood=M('wood',(.5,.34,.18),.5,temp=21,noise=(5,(.35,.22,.1),(.62,.45,.27))); box((0,0,.86),(1.5,1.1,.06),wood,bevel=.01)
for x in (-.65,.65):
    for y in (-.45,.45): box((x,y,.42),(.07,.07,.84),M('leg%d%d'%(int(x*10),int(y*10)),(.2,.2,.22),.5,temp=20.5))
mat_=M('mat',(.05,.15,.3),.7,temp=21.5,noise=(8,(.04,.11,.24),(.06,.19,.36))); box((0,0,.895),(.8,.6,.008),mat_)
pcb=M('pcb',(.03,.3,.1),.4,temp=31,decal=image_tex('pcbdecal',256,256,lambda w,h: random_decal(w,h,(.03,.3,.1),40,random.Random(7))),temp_fn=[[.05,.02,.93,.06,14.0]]); box((0,0,.92),(.46,.32,.012),pcb)
alu=M('alu',(.75,.75,.76),.3,.9,temp=47); black=M('black',(.03,.03,.03),.5,temp=38); hot=M('hot',(.05,.05,.06),.4,temp=88); coil=M('coil',(.65,.3,.12),.35,.7,temp=61); cap=M('cap',(.1,.12,.35),.4,temp=34)
for k in range(9): box((-.12+.012*k,.08,.975),(.004,.11,.1),alu)
box((-.07,.08,.93),(.12,.12,.02),alu)
for i,(x,y) in enumerate(((.08,.1),(.13,.1),(.08,.05),(.17,-.06))): box((x,y,.935),(.035,.03,.016),hot if i%2==0 else black,bevel=.002)
for x,y in ((.02,-.08),(.08,-.09)): 
    bpy.ops.mesh.primitive_torus_add(location=(x,y,.945),major_radius=.026,minor_radius=.012); obj(bpy.context.object,coil)
for i in range(6): cyl((-.19+.036*i,-.125,.955),.013,.06,cap,v=24,bevel=.002); cyl((-.19+.036*i,-.125,.986),.011,.002,alu,v=24)
box((-.15,-.04,.965),(.11,.08,.08),M('trafo',(.75,.6,.1),.5,temp=53),bevel=.006); box((.19,.08,.95),(.05,.12,.05),M('relay',(.1,.2,.6),.5,temp=29),bevel=.003)
for i in range(7):
    a=rng.uniform(0,6.28); c=M('wire%d'%i,(rng.random(),rng.random()*.5,rng.random()),.5,temp=23)
    for k in range(16): cyl((.24+.02*k,-.1+.03*i+.03*math.sin(.5*k+a),.905+.02*math.exp(-k*.3)),.004,.024,c,rot=(0,math.pi/2,.3*math.cos(.5*k+a)),v=8)
cyl((-.5,.3,.95),.045,.12,M('mug',(.8,.78,.7),.3,temp=43),v=40); box((.5,.35,.93),(.25,.16,.09),M('meter',(.8,.6,.05),.5,temp=25),bevel=.02); box((.5,.29,.94),(.15,.04,.05),M('lcd',(.5,.6,.5),.2,temp=27))
cyl((-.42,-.33,.9),.012,.25,M('driver',(.8,.1,.1),.4,temp=22),rot=(0,math.pi/2,.5),v=16); box((.35,-.4,.9),(.2,.14,.02),M('book',(.6,.2,.15),.6,temp=21,decal=image_tex('bookd',128,128,lambda w,h: random_decal(w,h,(.6,.55,.4),12,random.Random(3)))))
for i in range(14):
    a=i*2*math.pi/14+rng.uniform(-.1,.1); r=rng.uniform(2.6,3.2); h=rng.uniform(.8,2.0)
    box((r*math.cos(a),r*math.sin(a),h/2),(.5,.7,h),M('shelf%d'%i,(rng.random()*.6,rng.random()*.6,rng.random()*.6),.6,temp=rng.uniform(18,23),noise=(rng.uniform(2,6),(rng.random()*.4,rng.random()*.4,rng.random()*.4),(.4+rng.random()*.5,.4+rng.random()*.5,.4+rng.random()*.5))),rot=(0,0,a))
for k in range(4):
    a=k*math.pi/2; box((4.2*math.cos(a),4.2*math.sin(a),1.4),(.1,8.4,2.8),M('plaster%d'%k,(.75,.74,.7),.9,temp=19+.4*k,noise=(1.5,(.66,.64,.6),(.82,.81,.78))),rot=(0,0,a))
CONFIG=dict(target=(0,0,.94),vis_r=.75,ir_r=1.0,ir_hfov=38,vis_hfov=56,vis_el=(22,48),ir_el=(18,42),irres=(240,180),sky=19.0,sun=60.0,jitter=.2)
