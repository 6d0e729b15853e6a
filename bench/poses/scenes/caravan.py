# SPDX-License-Identifier: BSD-3-Clause
# A caravan on a meadow before dawn: all of it within four kelvin but a window behind which somebody heats; pale, plain walls with a
# stripe, rounded edges; an overcast sky that is nearly as warm as the ground. For ../shared/scenes/render_orbit.py.
meadow=M('meadow',(.12,.2,.06),.95,temp=8.5,noise=(14,(.06,.13,.03),(.2,.28,.1)),temp_fn=[[2.5,1.0,0,1.2,.8]]); ground(meadow)
shell=M('shell',(.82,.81,.76),.35,temp=9.6); stripe=M('stripe',(.1,.25,.45),.4,temp=9.4); roof=M('roof',(.7,.7,.7),.5,temp=8.2)
glass=M('glass',(.05,.06,.07),.05,temp=11.0); warm=M('warm',(.09,.08,.05),.05,temp=13.0); rubber=M('rubber',(.02,.02,.02),.9,temp=8.8); steel=M('steel',(.45,.46,.48),.4,.8,temp=8.0)
red=M('red',(.6,.03,.02),.3,temp=9.2); wood=M('wood',(.3,.19,.1),.9,temp=9.0,noise=(7,(.2,.12,.06),(.42,.28,.16)))
box((0,0,1.35),(3.6,2.0,1.8),shell,bevel=.28)
box((0,0,2.27),(2.9,1.5,.06),roof,bevel=.03); box((.5,0,2.36),(.5,.5,.12),glass,bevel=.03); cyl((-1.0,.4,2.38),.1,.18,steel)
for s in (-1,1):
    box((0,s*1.0,.95),(3.1,.03,.16),stripe); box((-.9,s*1.0,1.62),(.8,.03,.5),glass if s<0 else warm,bevel=.02); cyl((.1,s*.95,.34),.34,.22,rubber,rot=(math.pi/2,0,0)); cyl((.1,s*1.07,.34),.16,.02,steel,rot=(math.pi/2,0,0))
    box((-1.79,s*.7,.75),(.05,.22,.12),red); box((1.79,s*.75,.8),(.04,.14,.1),M('lamp%d'%s,(.85,.85,.8),.1,temp=9.1))
box((.95,-1.0,1.3),(.62,.035,1.45),M('door',(.78,.77,.72),.35,temp=9.9),bevel=.02); box((.95,-1.03,1.75),(.36,.02,.3),glass); box((.72,-1.04,1.25),(.05,.04,.14),steel)
box((1.81,0,1.65),(.03,1.3,.5),glass,bevel=.02); box((-1.81,0,1.65),(.03,1.1,.45),glass,bevel=.02); box((-1.82,0,.8),(.02,.5,.12),M('plate',(.9,.8,.1),.5,temp=9.0))
box((2.35,0,.48),(1.1,.09,.09),steel); box((2.2,0,.68),(.5,.7,.34),M('gasbox',(.75,.74,.7),.4,temp=8.9),bevel=.05); cyl((2.85,0,.3),.05,.6,steel)
cyl((.2,1.06,.7),.09,.06,M('flue',(.4,.4,.42),.5,temp=16.0),rot=(math.pi/2,0,0)); box((1.2,1.01,.8),(.5,.02,.35),M('hatch',(.8,.79,.75),.4,temp=9.3),bevel=.01)
box((.95,-1.45,.12),(.6,.35,.24),wood); box((-1.2,-2.3,.36),(1.0,.6,.05),wood)
for x in (-1.6,-.8):
    for y in (-2.5,-2.1): box((x,y,.17),(.05,.05,.34),wood)
for k in range(2): cyl((-2.6,.9+.45*k,.35),.17,.7,M('gas%d'%k,(.1+.4*k,.3,.5-.3*k),.4,temp=8.4+.4*k))
for k in range(5): box((2.4+.25*k,2.2,.2+.0*k),(.22,.6,.4),M('log%d'%k,(.25+.05*k,.16,.08),.95,temp=8.3+.3*k,noise=(9,(.16,.1,.05),(.4,.27,.15))),rot=(0,0,.1*k))
surroundings(5.0,13,10,26)
CONFIG=dict(target=(0,0,1.2),vis_r=5.4,ir_r=6.6,ir_hfov=45,vis_hfov=64,vis_el=(9,30),ir_el=(7,26),irres=(384,288),sky=2.0,sun=60.0)
