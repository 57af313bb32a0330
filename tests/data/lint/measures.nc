%measures
L CYCLE [NAME="MeasureWait.cyc", @P1="bore", @P2=20, @P3=0.1]
V.P.BORE = STR_TO_REAL[V.G.SERVICE.RESPONSE]
M30
