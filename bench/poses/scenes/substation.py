# SPDX-License-Identifier: BSD-3-Clause
# Three poles of a disconnector on a lattice frame: thin grey bars, equal brown insulators, one contact hot; little stands behind it.
# For ../shared/scenes/render_orbit.py.
gravel=M('gravel',(.4,.4,.41),.95,temp=12,noise=(22,(.24,.24,.25),(.58,.58,.57))); ground(gravel)
zinc=M('zinc',(.55,.57,.58),.45,.7,temp=10.5); conc=M('concrete',(.55,.54,.5),.95,temp=13,noise=(9,(.45,.44,.41),(.63,.62,.58)))
copper=M('copper',(.72,.42,.25),.35,.9,temp=17); brown=[M('brown%d'%k,(.22,.09,.04),.2,temp=11+.4*k) for k in range(6)]
def bar(a,b,w,m):
    a,b=Vector(a),Vector(b); d=b-a; L=d.length; q=d.to_track_quat('Z','Y').to_euler()
    box(tuple((a+b)/2),(w,w,L),m,rot=tuple(q))
for x in (-1.15,1.15):
    legs=[(x-.2,-.2),(x+.2,-.2),(x+.2,.2),(x-.2,.2)]
    box((x,0,.08),(.8,.8,.16),conc,bevel=.02)
    for lx,ly in legs: bar((lx,ly,.16),(lx,ly,1.7),.05,zinc)
    for k in range(4):
        z0=.2+.37*k
        for i in range(4):
            (ax,ay),(bx,by)=legs[i],legs[(i+1)%4]
            bar((ax,ay,z0),(bx,by,z0+.37) if (i+k)%2 else (bx,by,z0+.37),.025,zinc)
for y in (-.2,.2): bar((-1.6,y,1.74),(1.6,y,1.74),.09,zinc)
n=0
for p,x in enumerate((-1.2,0,1.2)):
    for y in (-.62,.62):
        bar((x,0,1.8),(x,y,1.8),.07,zinc); t=brown[n]; n+=1
        cyl((x,y,2.15),.045,.66,t)
        for k in range(7): cyl((x,y,1.9+.085*k),.11 if k%2 else .09,.022,t,v=32)
        cyl((x,y,2.5),.06,.06,zinc); box((x,y,2.55),(.12,.16,.05),copper)
    hot=26 if p==1 else 0
    contact=M('contact%d'%p,(.7,.45,.3),.4,.8,temp=18+hot,temp_fn=[[x,.62,2.58,.12,.6*hot]])
    bar((x,-.62,2.6),(x,.62,2.6),.045,copper); box((x,.62,2.6),(.1,.2,.09),contact,bevel=.01); box((x,.1,2.62),(.07,.3,.05),contact)
    bar((x,.62,2.58),(x+.1,1.5,2.2),.025,copper); bar((x,-.62,2.58),(x-.1,-1.5,2.25),.025,copper)
    for y,z in ((1.5,2.2),(-1.5,2.25)): cyl((x+(.1 if y>0 else -.1),y,z-.55),.035,1.1,zinc); cyl((x+(.1 if y>0 else -.1),y,z-1.15),.16,.1,conc)
box((-1.15,-.42,.85),(.36,.22,.5),M('drive',(.75,.76,.72),.5,temp=15,temp_fn=[[-1.15,-.5,.9,.2,4]]),bevel=.02); bar((-1.15,-.42,1.1),(-1.15,-.1,1.74),.04,zinc)
box((1.15,-.4,1.2),(.3,.02,.22),M('sign',(.95,.8,.05),.5,temp=11,decal=image_tex('s',96,72,lambda w,h: random_decal(w,h,(.95,.8,.05),9,random.Random(5)))))
box((2.4,1.3,.45),(.6,.5,.9),M('cabinet',(.35,.42,.36),.5,temp=16),rot=(0,0,.3),bevel=.02); cyl((-2.4,1.5,.35),.35,.7,M('reel',(.5,.33,.16),.9,temp=11,noise=(8,(.4,.25,.1),(.6,.42,.24))),rot=(math.pi/2,0,.5))
for k in range(5): box((-1.8+.8*k,-2.3+.25*(k%3),.1),(.5,.25,.2),M('slab%d'%k,(.5,.5,.48),.9,temp=10+k,noise=(10,(.4,.4,.38),(.6,.6,.58))),rot=(0,0,.5*k))
surroundings(4.8,13,9,26)
CONFIG=dict(target=(0,0,1.4),vis_r=4.9,ir_r=6.0,ir_hfov=42,vis_hfov=62,vis_el=(8,30),ir_el=(6,26),irres=(384,288),sky=-20.0,sun=200.0)
