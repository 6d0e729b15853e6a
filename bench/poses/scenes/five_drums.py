# SPDX-License-Identifier: BSD-3-Clause
# drums.py with five drums round one in the middle, alike every 72 degrees, and labels on two of them: what was chosen on that
# scene is scored on this one. For ../shared/scenes/render_orbit.py.
floor=M('floor',(.4,.4,.39),.8,temp=17,noise=(8,(.28,.28,.27),(.52,.52,.5))); ground(floor)
wood=M('wood',(.42,.3,.17),.9,temp=16,noise=(9,(.28,.19,.1),(.55,.4,.25))); strap=M('strap',(.9,.45,.03),.6,temp=17)
for k in range(7): box((-1.2+.4*k,0,.16),(.3,2.7,.05),wood)
for y in (-1.2,0,1.2): box((0,y,.07),(2.7,.18,.13),wood)
temps=[22,27,33,18,24,41,29]
for k in range(6):
    a=k*2*math.pi/5; x,y=(0,0) if k==5 else (.86*math.cos(a),.86*math.sin(a))
    paint=M('paint%d'%k,(.45,.3,.05),.35,temp=temps[k],temp_fn=[[x,y,.3,.35,.25*(temps[k]-17)]])
    cyl((x,y,.66),.41,.95,paint,v=72)
    for z in (.22,.5,.82,1.12): cyl((x,y,z),.425,.03,paint,v=72)
    cyl((x,y,1.145),.37,.02,M('lid%d'%k,(.05,.15,.45),.4,temp=temps[k]-2)); cyl((x+.22,y+.1,1.17),.05,.05,M('bung%d'%k,(.6,.6,.6),.4,.7,temp=18))
    if k in (1,4):
        box((x+.415*math.cos(a),y+.415*math.sin(a),.68),(.02,.34,.4),M('label%d'%k,(.85,.83,.75),.6,temp=temps[k],decal=image_tex('l%d'%k,192,192,lambda w,h: random_decal(w,h,(.85,.83,.75),16,random.Random(40+k)))),rot=(0,0,a))
for z in (.45,.95):
    bpy.ops.mesh.primitive_torus_add(location=(0,0,z),major_radius=1.3,minor_radius=.015,major_segments=96,minor_segments=6); obj(bpy.context.object,strap)
box((2.3,-1.4,.5),(.7,.5,1.0),M('cart',(.7,.1,.05),.5,temp=19),rot=(0,0,.4),bevel=.02); cyl((-2.2,1.6,.3),.22,.6,M('bin',(.2,.35,.2),.6,temp=15))
for k in range(4): box((-2.4+.5*k,-2.2,.14+.03*k),(.4,.4,.28+.06*k),M('crate%d'%k,(.35+.1*k,.28,.2),.9,temp=15+k,noise=(6,(.25,.18,.1),(.6,.48,.33))),rot=(0,0,.5*k))
surroundings(3.6,9,12,22)
CONFIG=dict(target=(0,0,.6),vis_r=3.6,ir_r=4.2,ir_hfov=38,vis_hfov=60,vis_el=(16,40),ir_el=(14,34),irres=(320,240),sky=-5.0,sun=150.0)
