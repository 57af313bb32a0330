N10 G01 X100 F6000
N20 #MSG ["at decode time"]
N30 #MSG SYN ["at %d", 100]
N40 X200
N50 #MSG SYN ["at 200"]
N60 M30
