# SPDX-License-Identifier: BSD-3-Clause
# An eight-sided wooden kiosk whose sides are alike but for what is hung on three of them: the same panels, posts and shutters all
# round, a hot chimney and one warm wall behind; paving of equal slabs. For ../shared/scenes/render_orbit.py.
slab=M('slab',(.45,.44,.42),.9,temp=16,noise=(10,(.36,.35,.33),(.54,.53,.5))); joint=M('joint',(.18,.17,.16),.95,temp=15); ground(joint)
wood=M('wood',(.32,.2,.1),.75,temp=18,noise=(3,(.22,.13,.06),(.42,.28,.15))); green=M('green',(.08,.2,.12),.6,temp=19); white=M('white',(.75,.74,.7),.6,temp=18); dark=M('dark',(.06,.06,.07),.7,temp=17); tile=M('tile',(.3,.12,.08),.8,temp=14,noise=(8,(.2,.07,.05),(.4,.18,.12)))
warm=M('warm',(.33,.21,.1),.75,temp=27,temp_fn=[[1.3,.6,1.2,.4,9.0]]); flue=M('flue',(.3,.29,.28),.5,.7,temp=71); glow=M('glow',(.8,.75,.6),.4,temp=36)
poster=[M('poster%d'%k,(.8,.8,.78),.6,temp=18.5,decal=image_tex('poster%d'%k,256,256,lambda w,h,k=k: random_decal(w,h,(.8,.78,.7),20,random.Random(40+k)))) for k in range(3)]
for i in range(-7,8):
    for j in range(-7,8): box((i*1.0,j*1.0,.02),(.95,.95,.05),slab)
n=8; r=1.5; w=2*r*math.tan(math.pi/n)
cyl((0,0,.12),1.75,.2,white,v=8,rot=(0,0,math.pi/8))
for k in range(n):
    a=k*2*math.pi/n; ca,sa=math.cos(a),math.sin(a); at=lambda d,t,z: (d*ca-t*sa,d*sa+t*ca,z)
    box(at(r,0,.65),(.06,w*.96,.9),warm if k==1 else wood,rot=(0,0,a))
    for t in range(-3,4): box(at(r+.035,t*w/7.4,.65),(.015,.02,.86),dark,rot=(0,0,a))
    box(at(r,0,1.15),(.22,w*.98,.06),white,rot=(0,0,a)); box(at(r-.03,0,1.6),(.03,w*.8,.8),dark,rot=(0,0,a))
    for t in (-1,1):
        box(at(r+.12,t*w*.36,1.6),(.04,w*.2,.82),green,rot=(0,0,a+t*.5))
        for q in range(7): box(at(r+.145,t*w*.36,1.28+.11*q),(.02,w*.17,.02),white,rot=(0,0,a+t*.5))
    b=a+math.pi/n; R=r/math.cos(math.pi/n); cyl((R*math.cos(b),R*math.sin(b),1.1),.06,1.9,white,v=12); box((R*math.cos(b),R*math.sin(b),2.02),(.3,.08,.08),white,rot=(0,0,b))
bpy.ops.mesh.primitive_cone_add(location=(0,0,2.5),radius1=2.0,depth=.9,vertices=8,rotation=(0,0,math.pi/8)); obj(bpy.context.object,tile)
for k in range(n):
    b=k*2*math.pi/n+math.pi/n; a3=(2.02*math.cos(b),2.02*math.sin(b),2.08); v=Vector((0,0,2.97))-Vector(a3); cyl((Vector(a3)+Vector((0,0,2.97)))/2,.035,v.length,white,rot=v.to_track_quat('Z','Y').to_euler(),v=8)
cyl((.45,.3,2.95),.11,.9,flue); cyl((.45,.3,3.43),.15,.06,dark)
for k,s in ((1,0),(3,1),(6,2)):
    a=k*2*math.pi/n; box(((r+.06)*math.cos(a),(r+.06)*math.sin(a),.68),(.012,.55,.6),poster[s],rot=(0,0,a))
a=4*2*math.pi/n; box(((r+.35)*math.cos(a),(r+.35)*math.sin(a),.45),(.4,.7,.8),M('icebox',(.7,.72,.75),.35,temp=8),bevel=.04,rot=(0,0,a)); box(((r-.02)*1.0,0,1.65),(.03,.5,.4),glow)
for k in range(3):
    a=.5+k*2.1; x,y=3.4*math.cos(a),3.4*math.sin(a); cyl((x,y,.42),.03,.8,dark); cyl((x,y,.8),.4,.03,white); 
    for q in range(3): b=q*2.1+k; cyl((x+.6*math.cos(b),y+.6*math.sin(b),.24),.17,.44,wood,v=24)
box((-3.1,1.6,.5),(.5,.5,.9),M('bin',(.15,.2,.3),.6,temp=17),bevel=.05)
for k in range(20):
    a=k*2*math.pi/20; box((9*math.cos(a),9*math.sin(a),.6),(.7,2.2,1.2),M('hedge%d'%k,(.07,.16,.05),.95,temp=12,noise=(6,(.03,.09,.02),(.13,.26,.09))),rot=(0,0,a))
surroundings(4.4,15,9,8)
CONFIG=dict(target=(0,0,1.4),vis_r=5.2,ir_r=5.7,ir_hfov=48,vis_hfov=62,vis_el=(8,27),ir_el=(10,30),irres=(320,256),sky=-22.0,sun=150.0)
