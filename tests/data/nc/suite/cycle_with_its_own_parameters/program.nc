P1 = 1
L CYCLE [NAME=drill.cyc @P1=10 @P2=P1+1 @P4=-0.5]
L CYCLE [NAME="drill.cyc", @P1=20, @P3="a string"]
N30 L CYCLE [NAME=drill.cyc @P1=30 \
             @P2=31]
#MSG ["P1 is still %d", P1]
M30
