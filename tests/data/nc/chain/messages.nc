; 200 messages through a queue, the next one when those before it were read.
SSDQInit[SD.CONTROL]
#FLUSH WAIT
$FOR P1 = 1, 200, 1
SSDQ[SD.ALARMS, SD.CONTROL, "message " + INT_TO_STR[P1]]
#FLUSH WAIT
#WAIT FOR SD.CONTROL.LastGet == SD.CONTROL.LastFilled
$ENDFOR
#MSG ["all are read"]
M30
