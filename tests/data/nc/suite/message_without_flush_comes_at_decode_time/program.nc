N10 G01 X100 F6000
N20 #MSG ["before the motion ends"]
N30 #FLUSH CONTINUE
N40 #MSG ["still before"]
N50 M30
