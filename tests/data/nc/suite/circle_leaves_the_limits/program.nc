(both ends lie inside, the lowest point of the last circle does not)
N10 G02 X10 I5 F600
N20 G01 X-9 Y0
N30 G02 X9 Y0 I9
N40 G02 X-9 Y0 I-9 J-4
M30
