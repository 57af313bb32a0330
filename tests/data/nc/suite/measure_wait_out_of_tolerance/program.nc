L CYCLE [NAME="MeasureWait.cyc", @P1="bore", @P2=12.3, @P3=0.04]
#MSG ["never"]
M30
