V.G.SERVICE.REQUEST_STATE = 1
L CYCLE [NAME="SysServiceWait.cyc", @P1=0, @P2=1500, @P3=7]
#MSG ["state %d after %d ms", V.G.SERVICE.RESPONSE_STATE, V.G.TIMER[7]]
L CYCLE [NAME="SysServiceWait.cyc", @P1=0, @P2=60000, @P3=7]
#MSG ["state %d", V.G.SERVICE.RESPONSE_STATE]
M30
