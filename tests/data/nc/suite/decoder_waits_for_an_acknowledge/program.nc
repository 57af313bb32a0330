N10 G01 X100 F6000
N20 #MSG ACK ["well?"]
N30 #MSG ["at decode time"]
N40 X200
N50 M30
