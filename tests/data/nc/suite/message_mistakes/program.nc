N10 #MSG
N20 #MSG []
N30 #MSG ["a"
N40 #MSG LOUD ["a"]
N50 #MSG SAVE SYN ["a"]
N60 #MSG SAVE HMI ["a"]
N70 #MSG ["%d"]
N80 #MSG ["%d", 1, 2]
N90 #MSG ["%x", 1]
N100 #MSG ["100%"]
N110 #MSG ["a", , 1]
N120 #MSG ["a"] X10
N130 X10 #MSG ["a"]
N140 #MSG SYN SYN_ACK ["a"]
N150 #MSG ["%d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d", \
           1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21]
M30
