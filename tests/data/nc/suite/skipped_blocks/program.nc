/ #MSG ["level 1"]
/1 #MSG ["level 1"]
/2 #MSG ["level 2"]
N40 /3 #MSG ["not allowed behind the number"]
/10 N50 #MSG ["level 10"]
/11 #MSG ["no such level"]
/ $IF 1
M30
