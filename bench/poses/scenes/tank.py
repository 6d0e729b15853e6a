# SPDX-License-Identifier: BSD-3-Clause
# An upright tank on legs, nearly the same from all sides: a level that shows in temperatures alone, a manhole, a ladder, one pipe
# with a valve; gravel, a fence of posts all round. For ../shared/scenes/render_orbit.py.
gravel=M('gravel',(.35,.33,.3),.95,temp=19,noise=(11,(.2,.19,.17),(.48,.46,.42))); ground(gravel)
shell=M('shell',(.62,.63,.62),.35,.4,temp=21,noise=(1.2,(.55,.56,.55),(.68,.69,.68)),temp_fn=[[0,0,1.1,.55,17.0]])
band=M('band',(.3,.31,.32),.5,.3,temp=22); leg=M('leg',(.2,.25,.3),.6,temp=20); pad=M('pad',(.5,.5,.48),.9,temp=20,noise=(5,(.42,.42,.4),(.58,.58,.55))); steel=M('steel',(.45,.46,.48),.35,.8,temp=20)
hot=M('hot',(.55,.5,.42),.6,.1,temp=52,temp_fn=[[1.3,.4,.7,.25,15.0]]); yellow=M('yellow',(.8,.6,.05),.5,temp=19); red=M('red',(.6,.04,.03),.5,temp=24); sign=M('sign',(.8,.8,.78),.6,temp=20,decal=image_tex('label',256,256,lambda w,h: random_decal(w,h,(.8,.8,.78),18,random.Random(8))))
cyl((0,0,.1),1.35,.2,pad,v=64)
for k in range(4):
    a=math.pi/4+k*math.pi/2; box((.75*math.cos(a),.75*math.sin(a),.45),(.14,.14,.6),leg,rot=(0,0,a))
cyl((0,0,1.75),.95,2.1,shell,v=96)
for z,s in ((2.8,.32),(.7,.22)):
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0,0,z),segments=64,ring_count=24); o=bpy.context.object; o.scale=(.95,.95,s); bpy.ops.object.transform_apply(scale=True); obj(o,shell); [setattr(p,'use_smooth',True) for p in o.data.polygons]
for z in (.95,1.75,2.55): cyl((0,0,z),.965,.05,band,v=96)
cyl((.0,-.97,1.35),.27,.14,steel,rot=(math.pi/2,0,0)); cyl((0,-1.06,1.35),.31,.04,band,rot=(math.pi/2,0,0))
for k in range(10): a=k*math.pi/5; cyl((.27*math.cos(a),-1.09,1.35+.27*math.sin(a)),.02,.04,steel,rot=(math.pi/2,0,0),v=6)
for s in (-.2,.2): cyl((-1.1,s,1.75),.02,2.9,yellow)
for k in range(10): cyl((-1.1,0,.5+.27*k),.014,.4,yellow,rot=(math.pi/2,0,0))
for k in range(12):
    a=k*math.pi/6; cyl((.85*math.cos(a),.85*math.sin(a),3.15),.014,.6,yellow)
bpy.ops.mesh.primitive_torus_add(location=(0,0,3.43),major_radius=.85,minor_radius=.018,major_segments=64,minor_segments=8); obj(bpy.context.object,yellow)
cyl((1.15,.4,.7),.07,.7,hot,rot=(0,math.pi/2,0)); cyl((1.5,.4,.4),.07,.7,hot); cyl((1.5,.4,.8),.09,.16,hot); cyl((1.22,.4,.92),.12,.03,red); cyl((1.22,.4,.83),.02,.16,steel); box((2.1,.4,.12),(1.4,.14,.14),hot)
cyl((.4,.2,3.3),.06,.5,steel); cyl((.4,.2,3.58),.1,.06,steel); box((.55,.82,1.6),(.5,.02,.36),sign,rot=(0,0,-.6)); box((-.5,1.35,.55),(.5,.35,.9),M('cabinet',(.3,.34,.3),.5,temp=29),bevel=.02)
for k in range(40):
    a=k*2*math.pi/40; box((7.5*math.cos(a),7.5*math.sin(a),.75),(.08,.08,1.5),M('post%d'%k,(.35,.33,.3),.9,temp=17) if k%10==0 else leg,rot=(0,0,a))
for z in (.5,1.3):
    bpy.ops.mesh.primitive_torus_add(location=(0,0,z),major_radius=7.5,minor_radius=.03,major_segments=80,minor_segments=6); obj(bpy.context.object,steel)
surroundings(3.6,14,8,30)
CONFIG=dict(target=(0,0,1.6),vis_r=5.6,ir_r=6.2,ir_hfov=42,vis_hfov=62,vis_el=(10,34),ir_el=(8,28),sky=-18.0,sun=210.0)
