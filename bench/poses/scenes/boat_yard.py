# SPDX-License-Identifier: BSD-3-Clause
# A motor boat on a trailer in a yard with other boats near it: a large smooth white hull with little texture, a windscreen,
# thin rails and masts, neighbours alike; a thermal camera of 320x240. For ../shared/scenes/render_orbit.py.
ground(M('gravel',(.4,.39,.37),.95,temp=13,noise=(7,(.25,.24,.22),(.58,.56,.53))),60)
white=M('hull',(.86,.86,.85),.15,temp=17); deck=M('deck',(.72,.69,.62),.5,temp=19.5,noise=(5,(.62,.58,.5),(.78,.75,.68)))
blue=M('stripe',(.02,.06,.25),.25,temp=19); keel=M('keel',(.3,.05,.04),.8,temp=14,noise=(9,(.2,.03,.03),(.4,.1,.08)))
steel=M('steel',(.6,.6,.62),.2,.9,temp=14); glass=M('glass',(.03,.04,.05),.05,temp=12); black=M('black',(.02,.02,.02),.5,temp=16)
engine=M('outboard',(.05,.05,.06),.35,temp=38,temp_fn=[[-2.75,0,1.5,.22,24.0]]); leg=M('leg',(.08,.08,.09),.4,temp=25); seat=M('seat',(.6,.45,.3),.8,temp=22)
battery=M('hatch',(.7,.7,.68),.5,temp=29); tyre=M('tyre',(.02,.02,.02),.9,temp=15); letters=M('letters',(.1,.1,.12),.5,temp=18,decal=image_tex('name',256,128,lambda w,h: random_decal(w,h,(.86,.86,.85),9,random.Random(3))))
# Hull: sections from stern to bow, each keel, chine and gunwale of both sides.
def hull(at,length,beam,m,under,turn=0.0,z0=.55):
    c,s=math.cos(turn),math.sin(turn); put=lambda x,y,z:(at[0]+c*x-s*y,at[1]+s*x+c*y,z0+z)
    rows=[]
    for i in range(13):
        u=i/12; x=(u-.5)*length; b=beam/2*(1-max(0,u-.35)**2.2/.65**2.2*.98); rise=.55*max(0,u-.5)**2
        rows.append([put(x,0,rise*1.1),put(x,.72*b,.28+rise),put(x,b,.95+rise*.9)])
    v=[]; f=[]; g=[]
    for k in (1,-1):
        o=len(v)
        for i,r in enumerate(rows):
            u=i/12; x=(u-.5)*length; b=beam/2*(1-max(0,u-.35)**2.2/.65**2.2*.98); rise=.55*max(0,u-.5)**2
            v+=[put(x,0,rise*1.1),put(x,k*.72*b,.28+rise),put(x,k*b,.95+rise*.9)]
        for i in range(12):
            a=o+3*i; g.append((a,a+3,a+4,a+1)); f.append((a+1,a+4,a+5,a+2))
    mesh('side',v,f,m,.01); mesh('bottom',v,g,under,.01)
    mesh('transom',[rows[0][0],rows[0][1],rows[0][2],put(-length/2,-beam/2,.95),put(-length/2,-.36*beam,.28)],[(0,1,2,3,4)],m,.01)
    top=[r[2] for r in rows]; n=len(top); other=[v[3*13+3*i+2] for i in range(13)]
    mesh('top',[(p[0],p[1],p[2]-.12) for p in top+other],[(i,i+1,n+i+1,n+i) for i in range(12)],deck,.01)
hull((0,0),5.2,2.0,white,keel)
for y in (-1,1): box((-.6,y*1.0,1.28),(3.2,.015,.07),blue); box((-1.6,y*1.0,1.08),(1.1,.02,.26),letters)
box((.55,0,1.72),(.05,1.35,.45),glass,rot=(0,-.5,0)); box((.25,0,1.5),(.5,1.1,.35),white,bevel=.08); box((1.4,0,1.55),(.7,.6,.06),battery,bevel=.03)
for y in (-.45,.45): box((-.5,y,1.5),(.5,.45,.14),seat,bevel=.05); box((-.75,y,1.75),(.12,.45,.45),seat,bevel=.05)
box((-1.9,0,1.5),(.5,1.5,.2),seat,bevel=.05); cyl((.1,.35,1.75),.16,.03,black,rot=(0,1.1,0))
box((-2.78,0,1.55),(.42,.36,.5),engine,bevel=.1); box((-2.82,0,.95),(.16,.12,.8),leg,bevel=.03); cyl((-2.95,0,.55),.13,.06,steel,rot=(0,math.pi/2,0))
for k in range(7):
    x=.4+.28*k; y=.95*(1-max(0,(x+2.6)/5.2-.35)**2.2/.65**2.2)
    for q in (-1,1): cyl((x,q*y,1.78),.012,.5,steel)
# Trailer.
for y in (-.55,.55): box((.1,y,.42),(4.6,.08,.1),steel); cyl((-.9,y*1.75,.3),.3,.2,tyre,rot=(math.pi/2,0,0))
box((3.1,0,.42),(1.7,.08,.1),steel); cyl((3.9,0,.22),.03,.44,steel)
for x in (-1.6,.9): box((x,0,.47),(.1,1.3,.1),black)
# Neighbours, masts, a shed, barrels and planks.
for i,(x,y,t,l) in enumerate(((1,-9,.15,6.2),(-6,-8.5,-.2,5),(9,3,1.7,6.5),(-9,2,1.4,5.6),(2,9.5,3.2,6),(-6.5,8.5,2.9,5.2))):
    shade=rng.uniform(.55,.9); hull((x,y),l,2.1,M('other%d'%i,(shade,shade,shade*rng.uniform(.8,1)) if i%3 else (.1,.2,.4),.25,temp=14+rng.uniform(0,4)),keel,t)
    if i%2: cyl((x,y,5),.06,8,steel)
    for dx in (-1,1): box((x+dx,y,.35),(.15,1.6,.7),black)
box((-16,-4,2),(1,14,4),M('shed',(.35,.4,.35),.8,temp=11,noise=(1.5,(.25,.3,.25),(.5,.55,.5))))
for i in range(26):
    a=rng.uniform(0,6.28); r=rng.uniform(6.2,13); s=rng.uniform(.1,.45)
    box((r*math.cos(a),r*math.sin(a),s/2),(s*rng.uniform(.6,3),s,s),M('thing%d'%i,(rng.random()*.6,rng.random()*.5,rng.random()*.5),.8,temp=13+rng.uniform(-1,3)),rot=(0,0,rng.uniform(0,3)))
surroundings(5.5,22,14,14)
CONFIG=dict(target=(0,0,1.05),vis_r=5.2,ir_r=5.6,ir_hfov=48,vis_hfov=66,vis_el=(9,33),ir_el=(7,27),irres=(320,240),sky=-25.0,sun=150.0)
