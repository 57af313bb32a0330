G01 X100 F6000
L CYCLE [NAME="MeasureWait.cyc", @P1="bore", @P2=12.3, @P3=0.05]
#MSG ["bore %.3f", STR_TO_REAL[V.G.SERVICE.RESPONSE]]
L CYCLE [NAME="MeasureWait.cyc", @P1="bore"]
#MSG ["asked %s, got %s", V.G.SERVICE.REQUEST, V.G.SERVICE.RESPONSE]
M30
