/ #MSG ["level 1"]
/2 #MSG ["level 2"]
/3 G00 X10
/10 #MSG ["level 10"]
M30
