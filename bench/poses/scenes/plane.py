# SPDX-License-Identifier: BSD-3-Clause
# A light aircraft on an apron just after landing: large smooth white skins with little texture, thin wings and struts, a cowling warmed by
# its engine, hot brakes and exhaust stubs; painted marks, chocks, a fuel drum, hangars round about. For ../shared/scenes/render_orbit.py.
apron=M('apron',(.38,.38,.37),.9,temp=29,noise=(5,(.3,.3,.29),(.46,.46,.45)),temp_fn=[[2.2,0,0,.9,4.0]]); ground(apron)
white=M('white',(.82,.82,.8),.25,temp=24,noise=(.6,(.79,.79,.77),(.85,.85,.83))); stripe=M('stripe',(.05,.16,.42),.3,temp=27); dark=M('dark',(.05,.05,.055),.6,temp=26)
cowl=M('cowl',(.8,.8,.78),.3,temp=41,temp_fn=[[2.2,.2,1.35,.35,15.0]]); stub=M('stub',(.3,.27,.24),.5,.7,temp=185); glass=M('glass',(.05,.07,.08),.04,temp=18); tyre=M('tyre',(.03,.03,.03),.9,temp=33); brake=M('brake',(.3,.3,.31),.4,.8,temp=96)
steel=M('steel',(.6,.6,.62),.3,.9,temp=25); spin=M('spin',(.7,.1,.06),.3,temp=31); inlet=M('inlet',(.03,.03,.03),.8,temp=58); yellow=M('yellow',(.8,.62,.03),.6,temp=28)
reg=M('reg',(.82,.82,.8),.3,temp=25,decal=image_tex('planereg',256,128,lambda w,h: random_decal(w,h,(.82,.82,.8),9,random.Random(23))))
def bar(a,b,r,m,v=14):
    a,b=Vector(a),Vector(b); d=b-a; cyl((a+b)/2,r,d.length,m,rot=d.to_track_quat('Z','Y').to_euler(),v=v)
def loft(name,rings,m,n=20):
    v=[]; f=[]
    for x,zc,ry,rz in rings:
        for k in range(n): a=k*2*math.pi/n; v.append((x,ry*math.cos(a),zc+rz*math.sin(a)))
    for i in range(len(rings)-1):
        for k in range(n): f.append((i*n+k,i*n+(k+1)%n,(i+1)*n+(k+1)%n,(i+1)*n+k))
    f.append(tuple(range(n))); f.append(tuple(reversed(range((len(rings)-1)*n,len(rings)*n)))); mesh(name,v,f,m)
loft('nose',[(2.75,1.35,.25,.25),(2.6,1.34,.38,.36),(2.1,1.34,.5,.45),(1.5,1.38,.54,.5)],cowl)
loft('cabin',[(1.5,1.38,.55,.51),(.8,1.42,.58,.56),(-.4,1.45,.56,.56),(-1.2,1.42,.45,.46)],white)
loft('tail',[(-1.2,1.42,.45,.46),(-2.4,1.45,.27,.29),(-3.6,1.5,.12,.16)],white)
box((.75,0,1.86),(1.0,.92,.36),glass,bevel=.12); box((.72,0,2.06),(1.15,.98,.08),white,bevel=.03)
for s in (-1,1):
    box((.15,s*.57,1.72),(.9,.02,.3),glass); box((.4,s*.555,1.36),(1.0,.03,.06),stripe); box((-1.4,s*.42,1.45),(1.6,.02,.05),stripe,rot=(0,0,s*.09)); box((-1.9,s*.375,1.45),(.95,.015,.3),reg,rot=(0,0,s*.13))
    box((.35,s*2.2,2.14),(1.25,3.6,.1),white,bevel=.045); box((-.2,s*2.4,2.12),(.3,2.6,.06),M('flap%d'%s,(.76,.76,.75),.4,temp=23)); box((.35,s*4.02,2.16),(1.1,.12,.1),stripe,bevel=.04); cyl((.8,s*3.98,2.16),.05,.16,M('nav%d'%s,(.7,.05,.03) if s>0 else (.04,.5,.1),.2,temp=30),rot=(0,math.pi/2,0))
    for k in range(9): box((.35,s*(.8+.36*k),2.196),(1.1,.012,.004),dark)
    bar((.45,s*.52,.98),(.5,s*2.1,2.08),.035,white); bar((.1,s*.3,.95),(.05,s*1.05,.3),.04,steel); cyl((.05,s*1.15,.24),.24,.15,tyre,rot=(math.pi/2,0,0),v=40,bevel=.03); cyl((.05,s*1.06,.24),.12,.04,brake,rot=(math.pi/2,0,0))
    box((.38,s*1.15,.07),(.16,.3,.14),yellow); box((-.28,s*1.15,.07),(.16,.3,.14),yellow)
    box((-3.35,s*.75,1.55),(.6,1.4,.06),white,bevel=.025); box((-3.6,s*.75,1.55),(.2,1.3,.04),M('elev%d'%s,(.76,.76,.75),.4,temp=23))
    cyl((2.72,s*.22,1.42),.1,.03,inlet,rot=(0,math.pi/2,0)); cyl((1.75,s*.22,.86),.045,.3,stub,rot=(0,.5,0))
mesh('fin',[(-2.7,.03,1.62),(-2.7,-.03,1.62),(-3.35,.03,2.7),(-3.35,-.03,2.7),(-3.85,.03,2.7),(-3.85,-.03,2.7),(-3.8,.03,1.5),(-3.8,-.03,1.5)],[(0,2,4,6),(1,7,5,3),(0,1,3,2),(2,3,5,4),(4,5,7,6),(0,6,7,1)],white)
for s in (-1,1): box((-3.45,s*.04,2.2),(.45,.012,.5),stripe)
bar((2.1,0,.95),(2.2,0,.26),.035,steel); cyl((2.2,0,.2),.2,.13,tyre,rot=(math.pi/2,0,0),v=36,bevel=.03)
cyl((2.85,0,1.36),.13,.26,spin,rot=(0,math.pi/2,0),bevel=.06)
for k in range(2): box((2.86,.55*math.cos(k*math.pi+.5),1.36+.55*math.sin(k*math.pi+.5)),(.03,1.0,.12),dark,rot=(k*math.pi+.5,0,0))
cyl((1.9,2.9,.45),.29,.9,M('drum',(.1,.3,.55),.4,temp=22,noise=(4,(.07,.22,.42),(.16,.38,.62))),v=40); box((-2.6,2.3,.35),(.9,.6,.7),M('cart',(.62,.12,.06),.5,temp=34,noise=(3,(.5,.09,.04),(.72,.16,.09)))); box((-2.6,2.3,.8),(.5,.4,.2),M('gpu',(.2,.2,.2),.6,temp=52))
for k in range(9): box((-5+1.25*k,-3.4,.006),(.8,.12,.01),yellow)
for a in (0,.9): box((0,3.6,.006),(9,.1,.01),M('line%d'%int(a*10),(.75,.75,.72),.7,temp=27),rot=(0,0,a))
for k in range(22):
    a=k*2*math.pi/22; box((15*math.cos(a),15*math.sin(a),rng.uniform(1,2)),(rng.uniform(1,3),rng.uniform(2,4),rng.uniform(2,5)),M('hangar%d'%k,(rng.uniform(.2,.7),rng.uniform(.2,.7),rng.uniform(.2,.7)),.7,temp=rng.uniform(17,30),noise=(rng.uniform(.6,2),(.3,.3,.32),(.6,.58,.55))),rot=(0,0,a))
surroundings(6,20,4,30)
CONFIG=dict(target=(-.3,0,1.2),vis_r=8.0,ir_r=8.8,ir_hfov=46,vis_hfov=62,vis_el=(8,26),ir_el=(10,27),irres=(320,240),sky=-18.0,sun=70.0)
