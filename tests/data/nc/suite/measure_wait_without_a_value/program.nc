L CYCLE [NAME="MeasureWait.cyc", @P1="bore"]
#MSG ["never"]
M30
