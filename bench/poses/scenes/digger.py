# SPDX-License-Identifier: BSD-3-Clause
# A small digger on a building site: yellow painted plates, black tracks of equal links, an arm that reaches out over half of the
# views, hot exhaust and hydraulic rams; puddles of sand. For ../shared/scenes/render_orbit.py.
soil=M('soil',(.3,.22,.14),.95,temp=17,noise=(7,(.18,.13,.08),(.45,.34,.22))); ground(soil)
yel=M('yellow',(.85,.5,.02),.35,temp=26); dark=M('dark',(.05,.05,.05),.7,temp=22); steel=M('steel',(.55,.55,.57),.3,.9,temp=24); glass=M('glass',(.04,.05,.06),.05,temp=20)
engine=M('engine',(.82,.48,.02),.35,temp=34,temp_fn=[[-1.0,.2,1.1,.5,22]])
for s in (-1,1):
    box((0,s*.75,.3),(2.0,.36,.42),dark,bevel=.2)
    for k in range(14): box((-.95+.146*k,s*.75,.53),(.1,.38,.05),M('link%d%d'%(k,s),(.08,.08,.085),.6,.5,temp=22+.2*k)); box((-.95+.146*k,s*.75,.07),(.1,.38,.05),dark)
    for k in range(5): cyl((-.8+.4*k,s*.93,.28),.12,.04,M('roller%d%d'%(k,s),(.3,.22,.03),.5,temp=25+k),rot=(math.pi/2,0,0))
cyl((0,0,.58),.45,.18,steel); box((-.15,0,.78),(1.9,1.3,.24),yel,bevel=.05); box((-.85,.1,1.1),(.75,1.2,.55),engine,bevel=.1)
for k in range(7): box((-.85,.71,.92+.06*k),(.5,.02,.025),dark)
box((.15,-.32,1.45),(.95,.68,1.25),yel,bevel=.06); box((.64,-.32,1.62),(.02,.56,.75),glass); 
for s in (-1,1): box((.15,-.32+s*.345,1.62),(.7,.02,.7),glass)
box((-.34,-.32,1.65),(.02,.5,.6),glass); box((.15,-.32,2.1),(1.05,.76,.06),dark,bevel=.02)
cyl((-1.0,.35,1.55),.05,.45,M('exhaust',(.2,.18,.16),.5,.6,temp=96)); cyl((-.62,.45,1.42),.12,.1,M('cap',(.1,.1,.1),.5,temp=33))
def bar(a,b,w,m,bev=.02):
    ax,ay,az=a; bx,by,bz=b; L=math.dist(a,b); th=math.atan2(bz-az,bx-ax)
    box(((ax+bx)/2,(ay+by)/2,(az+bz)/2),(L,w,w*1.2),m,rot=(0,-th,0),bevel=bev)
def ram(a,b,t):
    L=math.dist(a,b); th=math.atan2(b[2]-a[2],b[0]-a[0]); m=tuple((p+q)/2 for p,q in zip(a,b))
    cyl(m,.035,L,steel,rot=(0,math.pi/2-th,0)); q=tuple(p+.3*(r-p) for p,r in zip(a,b)); cyl(q,.06,L*.6,M('ram%d'%t,(.8,.46,.02),.4,temp=t),rot=(0,math.pi/2-th,0))
bar((.7,.25,.9),(1.5,.25,2.2),.2,yel); bar((1.5,.25,2.2),(2.4,.25,1.75),.18,yel); bar((2.4,.25,1.75),(2.75,.25,.75),.15,yel)
ram((.9,.25,.85),(1.5,.25,1.9),44); ram((1.55,.25,2.35),(2.3,.25,2.0),39); ram((2.3,.25,1.85),(2.65,.25,1.1),47)
mesh('bucket',[(2.5,-.1,.75),(2.5,.6,.75),(3.05,-.1,.7),(3.05,.6,.7),(2.55,-.1,.3),(2.55,.6,.3),(2.95,-.1,.25),(2.95,.6,.25)],[(0,1,5,4),(4,5,7,6),(6,7,3,2),(0,4,6,2),(1,3,7,5)],M('bucket',(.25,.23,.2),.5,.6,temp=28),bevel=.02)
for k in range(4): box((2.58+.0*k,-.02+.19*k,.24),(.08,.07,.14),steel)
box((-1.15,-.3,.95),(.06,.34,.12),M('lamps',(.7,.05,.03),.3,temp=27)); box((.66,.5,1.05),(.03,.3,.2),M('plate',(.9,.88,.8),.5,temp=26,decal=image_tex('p',128,96,lambda w,h: random_decal(w,h,(.9,.88,.8),14,random.Random(3)))))
for k in range(3): cyl((-2.3+.6*k,2.1-.2*k,.25),.2,.5,M('pipe%d'%k,(.7,.3,.12),.8,temp=18+2*k),rot=(math.pi/2,0,.6))
mesh('heap',[(2.0,-2.6,0),(3.4,-2.2,0),(3.0,-1.2,0),(1.9,-1.5,0),(2.6,-1.9,.7)],[(0,1,4),(1,2,4),(2,3,4),(3,0,4)],M('sand',(.6,.48,.3),.95,temp=15,noise=(12,(.5,.38,.22),(.7,.58,.4))),bevel=.03)
surroundings(4.6,12,11,28)
CONFIG=dict(target=(.4,.1,1.0),vis_r=4.9,ir_r=6.2,ir_hfov=45,vis_hfov=62,vis_el=(13,34),ir_el=(10,30),irres=(384,288),sky=-8.0,sun=70.0)
