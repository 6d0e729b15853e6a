# SPDX-License-Identifier: BSD-3-Clause
# A rack of solar modules on gravel: equal cells on one plane, blue and glossy, two of them hot; an inverter and a cable tray behind.
# Nothing tells one cell from the next but its place. For ../shared/scenes/render_orbit.py.
gravel=M('gravel',(.35,.33,.3),.95,temp=21,noise=(30,(.2,.19,.17),(.55,.52,.48))); ground(gravel)
frame=M('frame',(.75,.76,.78),.35,.9,temp=29); back=M('back',(.85,.85,.83),.7,temp=38); steel=M('steel',(.5,.52,.54),.4,.8,temp=24)
tilt=.5; ct,st=math.cos(tilt),math.sin(tilt)
def on(u,v,w): return (u,v*ct-w*st,1.15+v*st+w*ct)     # along the rack, up its slope, out of it
hot={(1,0,3,4):24,(3,1,2,7):13,(0,1,1,1):7}
for i in range(4):
    for j in range(2):
        cu,cv=-1.59+1.06*i,-.87+1.74*j
        box(on(cu,cv,0),(1.02,1.70,.035),frame,rot=(tilt,0,0)); box(on(cu,cv,-.02),(.98,1.66,.01),back,rot=(tilt,0,0))
        for a in range(6):
            for b in range(10):
                t=41+1.1*math.sin(1.3*i+2.1*j)+.5*math.sin(a+b)+hot.get((i,j,a,b),0)
                box(on(cu-.4+.16*a,cv-.729+.162*b,.019),(.154,.156,.004),M('cell%d_%d_%d_%d'%(i,j,a,b),(.015,.03,.1),.15,temp=t),rot=(tilt,0,0))
        box(on(cu,cv+.6,-.045),(.2,.12,.03),M('junction%d%d'%(i,j),(.03,.03,.03),.6,temp=44+3*i),rot=(tilt,0,0))
for k in range(5):
    x=-2.1+1.05*k; box((x,-1.3,.32),(.06,.06,.64),steel); box((x,1.3,.95),(.06,.06,1.9),steel); box(on(x,0,-.07),(.05,3.3,.06),steel,rot=(tilt,0,0))
for y,z in ((-1.3,.1),(1.3,.1),(1.3,1.0)): box((0,y,z),(4.3,.05,.05),steel)
inv=M('inverter',(.82,.83,.85),.4,temp=36,temp_fn=[[1.2,1.5,1.2,.3,9]]); box((1.2,1.42,1.05),(.5,.2,.7),inv,bevel=.03); box((1.2,1.31,1.2),(.2,.02,.12),M('display',(.02,.05,.1),.1,temp=37))
for k in range(3): cyl((1.05+.15*k,1.42,.35),.02,.7,M('cable%d'%k,(.05,.05,.05),.6,temp=27+4*k))
box((-.9,1.5,.9),(.4,.16,.5),M('combiner',(.6,.6,.62),.5,temp=31),bevel=.02); box((-.9,1.41,.95),(.14,.02,.14),M('warn',(.9,.75,.05),.5,temp=31,decal=image_tex('w',96,96,lambda w,h: random_decal(w,h,(.9,.75,.05),10,random.Random(8)))))
for k in range(6): box((-2.6+.9*k,-2.2+.2*(k%2),.12),(.3,.2,.24),M('block%d'%k,(.5,.5,.48),.9,temp=20+k,noise=(12,(.35,.35,.33),(.6,.6,.58))),rot=(0,0,.4*k))
surroundings(4.6,12,11,30)
CONFIG=dict(target=(0,.1,1.1),vis_r=4.8,ir_r=6.0,ir_hfov=45,vis_hfov=62,vis_el=(14,36),ir_el=(11,31),irres=(384,288),sky=-12.0,sun=140.0)
