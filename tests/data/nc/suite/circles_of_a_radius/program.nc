(half circles of radius 5, as in the manual; then the shorter and the longer arc)
N10 G90 G01 X0 Y0 F600
N20 G02 X10 R5
N30 G03 X20
N40 #MSG SYN ["the radius stays"]
N50 G02 R=10
N60 #MSG SYN ["no motion"]
N70 X30 Y10
N80 #MSG SYN ["a quarter"]
N90 X40 Y0 R1=-10
N100 #MSG SYN ["three quarters"]
M30
