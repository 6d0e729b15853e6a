# SPDX-License-Identifier: BSD-3-Clause
# A wheel loader at work: big tyres with lugs, a raised bucket, glass all round the cab, a hot engine hood, hydraulics and exhaust;
# a gravel pit with heaps and a sunlit bank, thermal camera of 384x288. For ../shared/scenes/render_orbit.py.
pit=M('pit',(.42,.36,.27),.95,temp=23,noise=(7,(.27,.22,.16),(.56,.49,.38)),temp_fn=[[-1.8,0,0,.9,3.0]]); ground(pit)
paint=M('paint',(.75,.42,.02),.35,.1,temp=26,noise=(1.5,(.66,.36,.02),(.82,.5,.05))); dark=M('dark',(.06,.06,.065),.6,temp=25); tyre=M('tyre',(.025,.025,.025),.9,temp=31)
rim=M('rim',(.7,.4,.02),.45,temp=29); glass=M('glass',(.04,.06,.07),.05,temp=17); steel=M('steel',(.35,.33,.31),.45,.8,temp=24,noise=(5,(.2,.17,.14),(.5,.48,.45)))
hood=M('hood',(.74,.42,.02),.4,temp=39,temp_fn=[[-2.1,.3,1.75,.4,17.0]]); grille=M('grille',(.08,.08,.08),.8,temp=55,temp_fn=[[-2.75,0,1.5,.35,9.0]]); pipe=M('pipe',(.25,.22,.2),.5,.7,temp=118); rod=M('rod',(.75,.75,.77),.12,1.0,temp=43); hose=M('hose',(.03,.03,.03),.6,temp=51)
decal=M('decal',(.8,.8,.78),.5,temp=26,decal=image_tex('loaderdecal',256,256,lambda w,h: random_decal(w,h,(.75,.42,.02),14,random.Random(19))))
def bar(a,b,r,m,v=16):
    a,b=Vector(a),Vector(b); d=b-a; q=d.to_track_quat('Z','Y').to_euler(); cyl((a+b)/2,r,d.length,m,rot=q,v=v)
for x in (1.1,-1.5):
    for s in (-1,1):
        cyl((x,s*.98,.68),.68,.46,tyre,rot=(math.pi/2,0,0),v=64,bevel=.06); cyl((x,s*1.22,.68),.36,.02,rim,rot=(math.pi/2,0,0)); cyl((x,s*1.24,.68),.13,.05,dark,rot=(math.pi/2,0,0))
        for k in range(22):
            a=k*2*math.pi/22; box((x+.67*math.cos(a),s*.98+(.09 if k%2 else -.09),.68+.67*math.sin(a)),(.07,.3,.07),tyre,rot=(0,-a,0))
        for k in range(8):
            a=k*math.pi/4; cyl((x+.26*math.cos(a),s*1.24,.68+.26*math.sin(a)),.022,.03,steel,rot=(math.pi/2,0,0),v=6)
box((-1.5,0,.95),(2.3,1.3,.5),dark,bevel=.05); box((-1.95,0,1.5),(1.5,1.25,.75),hood,bevel=.09); box((-2.71,0,1.48),(.04,1.0,.55),grille)
for k in range(7): box((-2.74,0,1.27+.07*k),(.03,.96,.02),dark)
for s in (-1,1):
    for k in range(5): box((-2.2+.14*k,s*.63,1.55),(.05,.02,.4),grille)
    box((-1.5,s*.64,1.25),(.7,.015,.18),decal); box((-.75,s*.72,.75),(.55,.3,.05),steel); box((-.75,s*.8,.45),(.45,.25,.04),steel); bar((-.95,s*.72,1.0),(-.95,s*.72,2.0),.018,dark)
cyl((-1.75,-.35,2.15),.06,.6,pipe); box((-1.7,.35,1.98),(.35,.3,.22),dark,bevel=.05)
box((-.55,0,1.15),(1.1,1.2,.25),paint,bevel=.04); box((-.5,0,1.75),(1.0,1.14,1.0),glass,bevel=.04); box((-.5,0,2.32),(1.2,1.3,.12),paint,bevel=.05)
for x in (-1.02,.02):
    for s in (-.57,.57): box((x,s,1.75),(.07,.07,1.1),dark)
for s in (-.45,.45): box((.12,s,2.25),(.06,.16,.1),M('lamp%d'%int(s*10),(.85,.85,.8),.1,temp=33)); bar((.05,s*1.3,2.0),(.2,s*1.9,2.0),.012,dark); box((.22,s*1.95,1.95),(.03,.16,.26),dark)
box((.85,0,.95),(1.3,.9,.5),paint,bevel=.06); box((.2,0,.85),(.5,.5,.4),dark)
for s in (-.42,.42):
    bar((.75,s,1.35),(1.9,s,1.75),.11,paint); bar((1.9,s,1.75),(2.55,s,1.25),.09,paint); bar((.6,s*.8,.9),(1.2,s*.8,1.28),.07,dark); bar((1.2,s*.8,1.28),(1.75,s*.8,1.6),.035,rod); bar((.9,s*.5,1.4),(1.6,s*.5,1.9),.015,hose); bar((1.6,s*.5,1.9),(2.3,s*.5,1.7),.015,hose)
bar((1.0,0,1.45),(1.9,0,2.05),.06,dark); bar((1.9,0,2.05),(2.4,0,1.8),.03,rod)
mesh('bucket',[(2.5,-1.25,.95),(2.5,1.25,.95),(2.55,-1.25,1.85),(2.55,1.25,1.85),(3.5,-1.25,1.05),(3.5,1.25,1.05),(3.15,-1.25,1.9),(3.15,1.25,1.9),(2.35,-1.25,1.4),(2.35,1.25,1.4)],[(0,1,9,8),(8,9,3,2),(0,4,5,1),(0,8,2,6,4),(1,5,7,3,9)],steel,bevel=.02)
for k in range(8): box((3.55,-1.1+.314*k,1.05),(.22,.09,.05),steel)
for i,(x,y,r) in enumerate(((4.6,2.8,.8),(-4.2,3.4,1.1),(1.2,-4.6,.7))):
    bpy.ops.mesh.primitive_cone_add(location=(x,y,r*.35),radius1=r*1.5,depth=r*.7*1.4,vertices=40); obj(bpy.context.object,M('heap%d'%i,(.5,.44,.34),.95,temp=26+2*i,noise=(9,(.33,.28,.2),(.66,.58,.46))))
for k in range(26):
    a=k*2*math.pi/26; box((12*math.cos(a),12*math.sin(a),rng.uniform(.3,1.2)),(rng.uniform(2,4),rng.uniform(1,2),rng.uniform(1,3)),M('bank%d'%k,(.5,.42,.3),.95,temp=rng.uniform(20,30),noise=(rng.uniform(.8,2.5),(.3,.24,.16),(.64,.56,.42))),rot=(0,0,a))
for k in range(6):
    a=rng.uniform(0,6.28); cyl((5.6*math.cos(a),5.6*math.sin(a),.35),.04,.7,M('peg%d'%k,(.8,.15,.05),.6,temp=22))
surroundings(4.5,16,5,40)
CONFIG=dict(target=(0,0,1.2),vis_r=7.0,ir_r=7.8,ir_hfov=44,vis_hfov=64,vis_el=(9,28),ir_el=(7,24),irres=(384,288),sky=-8.0,sun=95.0)
