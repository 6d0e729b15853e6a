# SPDX-License-Identifier: BSD-3-Clause
# A motorcycle on a yard: spokes, cables and an open frame that one sees through, glossy tank, hot engine, exhaust and brakes,
# a clear cold sky; the thermal camera is a handheld of 320x240 with a wide lens. For ../shared/scenes/render_orbit.py.
yard=M('yard',(.3,.29,.27),.95,temp=14,noise=(9,(.2,.19,.17),(.4,.39,.36)),temp_fn=[[.1,0,0,.5,5.0]]); ground(yard)
red=M('red',(.5,.02,.02),.18,temp=17); black=M('black',(.03,.03,.03),.5,temp=16); rubber=M('rubber',(.02,.02,.02),.9,temp=21); chrome=M('chrome',(.65,.65,.67),.15,1.0,temp=15)
alloy=M('alloy',(.45,.45,.47),.4,.8,temp=58,temp_fn=[[.12,.0,.52,.14,28.0]]); pipe=M('pipe',(.5,.48,.45),.3,.9,temp=75,temp_fn=[[.35,-.16,.35,.2,60.0]]); disc=M('disc',(.4,.4,.42),.35,.9,temp=47)
seat=M('seat',(.05,.04,.04),.8,temp=24); plate=M('plate',(.8,.8,.75),.5,temp=15); lamp=M('lamp',(.85,.85,.8),.08,temp=18)
def bar(a,b,r,m):
    a,b=Vector(a),Vector(b); d=b-a; q=d.to_track_quat('Z','Y').to_euler(); cyl((a+b)/2,r,d.length,m,rot=q,v=16)
for x,w in ((.72,.11),(-.7,.16)):
    bpy.ops.mesh.primitive_torus_add(location=(x,0,.31),rotation=(math.pi/2,0,0),major_radius=.26,minor_radius=w/2,major_segments=64,minor_segments=16); obj(bpy.context.object,rubber)
    cyl((x,0,.31),.045,.16,chrome,rot=(math.pi/2,0,0)); cyl((x,-.09,.31),.13,.008,disc,rot=(math.pi/2,0,0))
    for k in range(18):
        a=k*2*math.pi/18; s=.05 if k%2 else -.05; bar((x+.04*math.cos(a),s,.31+.04*math.sin(a)),(x+.22*math.cos(a),0,.31+.22*math.sin(a)),.004,chrome)
for s in (-.09,.09): bar((.72,s,.31),(.45,s,.95),.024,chrome); bar((-.7,s,.31),(-.1,s,.36),.022,black); bar((-.62,s*1.6,.38),(-.5,s*1.6,.72),.02,chrome)
bar((.45,0,.92),(.2,0,.3),.022,black); bar((.2,0,.3),(-.15,0,.3),.022,black); bar((-.15,0,.3),(-.25,0,.7),.022,black); bar((.45,0,.86),(-.25,0,.7),.022,black); bar((-.25,0,.7),(-.75,0,.75),.018,black)
box((.1,0,.4),(.34,.3,.26),alloy,bevel=.04)
for k in range(6): box((.13,0,.55+.025*k),(.2,.24,.012),alloy)
bpy.ops.mesh.primitive_uv_sphere_add(location=(.17,0,.84),segments=48,ring_count=24); o=bpy.context.object; o.scale=(.3,.16,.13); bpy.ops.object.transform_apply(scale=True); obj(o,red); [setattr(p,'use_smooth',True) for p in o.data.polygons]
box((-.3,0,.79),(.55,.26,.08),seat,bevel=.035); box((-.78,0,.62),(.3,.17,.02),red,rot=(0,-.5,0),bevel=.008); box((.72,0,.64),(.36,.14,.015),red,bevel=.006)
bar((.3,-.14,.5),(.38,-.17,.3),.022,pipe); bar((.38,-.17,.3),(-.1,-.18,.24),.024,pipe); bar((-.1,-.18,.24),(-.85,-.2,.38),.042,pipe)
bar((.45,-.36,1.02),(.45,.36,1.02),.012,chrome); bar((.45,-.36,1.02),(.38,-.42,1.0),.017,black); bar((.45,.36,1.02),(.38,.42,1.0),.017,black)
cyl((.58,0,.93),.09,.1,chrome,rot=(0,math.pi/2,0)); cyl((.635,0,.93),.082,.01,lamp,rot=(0,math.pi/2,0)); box((-.93,0,.58),(.01,.18,.13),plate)
for s in (-1,1):
    bar((.45,s*.25,1.02),(.42,s*.3,1.2),.005,black); cyl((.42,s*.31,1.22),.05,.015,chrome,rot=(0,math.pi/2,0)); box((-.8,s*.14,.6),(.04,.05,.04),M('blink%d'%s,(.8,.3,.02),.3,temp=16)); box((.05,s*.22,.3),(.09,.12,.02),black)
bar((-.05,.16,.3),(-.12,.3,.01),.01,black); box((.02,.16,.62),(.1,.02,.16),M('battery',(.1,.1,.2),.6,temp=26)); box((-.1,-.15,.62),(.22,.02,.18),M('side',(.5,.02,.02),.2,temp=17))
for k in range(3): box((-2.6+.5*k,1.9,.16+.0*k),(.34,.5,.32),M('crate%d'%k,(.4+.1*k,.3,.15),.9,temp=13+k,noise=(6,(.25,.15,.07),(.6,.45,.25))),rot=(0,0,.3*k))
box((1.9,-2.1,.09),(.7,.5,.18),M('box',(.1,.25,.35),.6,temp=15),rot=(0,0,.5)); cyl((2.2,2.0,.22),.18,.44,M('can',(.15,.3,.12),.5,temp=12))
surroundings(4.2,11,9,26)
CONFIG=dict(target=(0,0,.55),vis_r=2.7,ir_r=3.1,ir_hfov=46,vis_hfov=60,vis_el=(15,42),ir_el=(12,34),irres=(320,240),sky=-35.0,sun=120.0)
