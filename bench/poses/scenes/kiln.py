# SPDX-License-Identifier: BSD-3-Clause
# A brick kiln at its firing: walls of one brick a hundred times over (repeated texture), a steel door that glows at its gap, a chimney, iron
# bands all alike; a clay yard with pallets of bricks. For ../shared/scenes/render_orbit.py.
yard=M('yard',(.4,.27,.19),.95,temp=21,noise=(6,(.3,.2,.14),(.52,.36,.26)),temp_fn=[[1.6,0,0,.9,9.0]]); ground(yard)
bricks=[M('brick%d'%k,(.45+.03*k,.19+.012*k,.11+.008*k),.9,temp=36+1.1*k,temp_fn=[[1.1,0,.9,.6,26.0]]) for k in range(5)]; mortar=M('mortar',(.55,.52,.47),.95,temp=37,temp_fn=[[1.1,0,.9,.6,24.0]])
iron=M('iron',(.12,.11,.11),.6,.6,temp=58); door=M('door',(.16,.13,.12),.6,.5,temp=142,temp_fn=[[1.32,0,.8,.25,60.0]]); gap=M('gap',(.95,.4,.1),.8,temp=690); stack=M('stack',(.4,.2,.14),.9,temp=74,noise=(4,(.3,.15,.1),(.5,.26,.18))); wood=M('wood',(.5,.38,.22),.85,temp=19,noise=(3,(.38,.28,.16),(.62,.48,.3))); steel=M('steel',(.55,.55,.56),.35,.8,temp=24)
def bar(a,b,r,m,v=14):
    a,b=Vector(a),Vector(b); d=b-a; cyl((a+b)/2,r,d.length,m,rot=d.to_track_quat('Z','Y').to_euler(),v=v)
W,D,H=2.4,2.0,1.7
box((0,0,H/2),(W,D,H),mortar)
n=0
for row in range(17):
    z=.05+.1*row; off=.115 if row%2 else 0
    for s in (-1,1):
        for k in range(-5,6):
            x=k*.23+off
            if abs(x)<W/2: box((x,s*(D/2+.012),z),(.212,.03,.084),bricks[(k*7+row*3+s)%5])
        for k in range(-4,5):
            y=k*.23+off
            if abs(y)<D/2 and not (s>0 and abs(y)<.42 and z<1.25): box((s*(W/2+.012),y,z),(.03,.212,.084),bricks[(k*5+row+2*s)%5])
for x in (-.9,-.3,.3,.9):
    for s in (-1,1): box((x,s*(D/2+.05),H/2),(.08,.05,H),iron); cyl((x,s*(D/2+.09),1.5),.03,.06,iron,rot=(math.pi/2,0,0),v=6)
    bar((x,-D/2-.05,1.5),(x,D/2+.05,1.5),.02,iron)
box((W/2+.05,0,.62),(.07,.8,1.2),door,bevel=.02); box((W/2+.088,0,1.2),(.012,.7,.03),gap); box((W/2+.088,-.385,.7),(.012,.02,.8),gap)
for z in (.25,.62,1.0): box((W/2+.1,0,z),(.03,.82,.06),iron)
cyl((W/2+.14,.28,.65),.09,.02,steel,rot=(0,math.pi/2,0)); bar((W/2+.1,-.5,.2),(W/2+.1,-.5,1.1),.03,iron)
mesh('vault',[(-W/2,-D/2,H),(W/2,-D/2,H),(-W/2,-.5,H+.35),(W/2,-.5,H+.35),(-W/2,.5,H+.35),(W/2,.5,H+.35),(-W/2,D/2,H),(W/2,D/2,H)],[(0,1,3,2),(2,3,5,4),(4,5,7,6),(0,2,4,6),(1,7,5,3)],M('vault',(.5,.24,.15),.9,temp=66,noise=(7,(.38,.17,.1),(.6,.3,.2))))
box((-.7,0,H+.85),(.5,.5,1.5),stack); box((-.7,0,H+1.62),(.6,.6,.1),mortar); cyl((-.7,0,H+1.68),.16,.05,M('flue',(.02,.02,.02),.9,temp=310))
for k in range(3): box((-.7,0,H+.4+.45*k),(.54,.54,.05),iron)
for s in (-1,1):
    for k in range(2): cyl((-.5+1.0*k,s*(D/2+.1),.25),.1,.2,M('burner%d%d'%(s,k),(.2,.2,.2),.5,.6,temp=120),rot=(math.pi/2,0,0)); bar((-.5+1.0*k,s*(D/2+.3),.25),(-.5+1.0*k,s*(D/2+.3),.7),.02,steel)
    bar((-1.2,s*(D/2+.3),.7),(1.2,s*(D/2+.3),.7),.03,M('gas%d'%s,(.75,.6,.05),.4,temp=20))
def pallet(x,y,rot,rows,seed):
    r=random.Random(seed); c,s=math.cos(rot),math.sin(rot)
    for k in range(3): box((x-s*(k-1)*.4,y+c*(k-1)*.4,.06),(1.1,.12,.1),wood,rot=(0,0,rot))
    for z in range(rows):
        for i in range(4):
            for j in range(4):
                if z==rows-1 and r.random()<.35: continue
                u,v=(i-1.5)*.26,(j-1.5)*.24; box((x+c*u-s*v,y+s*u+c*v,.16+.105*z),(.24,.2,.095),M('pb%d_%d_%d_%d'%(seed,z,i,j),(r.uniform(.42,.6),r.uniform(.18,.28),r.uniform(.1,.17)),.9,temp=r.uniform(22,29)+(9 if seed==2 else 0)),rot=(0,0,rot))
pallet(2.9,1.5,.4,5,1); pallet(2.6,-1.9,-.2,3,2); pallet(-2.4,1.9,1.1,6,3); pallet(-2.3,-1.7,.7,4,4)
box((.2,2.3,.45),(.5,.9,.06),wood); 
for s in (-.18,.18):
    for t in (1.95,2.65): bar((.2+s,t,0),(.2+s,t,.43),.025,wood)
bar((1.9,-.9,.02),(1.35,-1.25,1.5),.02,steel); cyl((.1,2.2,.62),.13,.28,M('bucket',(.1,.25,.5),.5,temp=18),v=32)
for k in range(24):
    a=k*2*math.pi/24; box((9*math.cos(a),9*math.sin(a),rng.uniform(.4,1.2)),(rng.uniform(1,2),rng.uniform(1,2.4),rng.uniform(1,3)),M('shed%d'%k,(rng.uniform(.25,.6),rng.uniform(.2,.5),rng.uniform(.15,.45)),.85,temp=rng.uniform(13,24),noise=(rng.uniform(.8,2),(.25,.2,.17),(.6,.5,.4))),rot=(0,0,a))
surroundings(4,13,4,30)
CONFIG=dict(target=(0,0,1.1),vis_r=5.2,ir_r=5.8,ir_hfov=44,vis_hfov=60,vis_el=(9,30),ir_el=(8,25),irres=(320,240),sky=-5.0,sun=60.0)
