; Seven messages at once, as fast as they can be written; then their reader has its time.
SSDQInit[SD.CONTROL]
#FLUSH WAIT
$FOR P1 = 1, 7, 1
SSDQ[SD.ALARMS, SD.CONTROL, "message " + INT_TO_STR[P1]]
$ENDFOR
#FLUSH WAIT
#WAIT FOR SD.CONTROL.LastGet == SD.CONTROL.LastFilled
#MSG ["all are read"]
M30
