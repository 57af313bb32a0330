; Two messages, and nobody is waited for.
SSDQInit[SD.CONTROL]
SSDQ[SD.ALARMS, SD.CONTROL, "drill worn"]
SSDQ[SD.ALARMS, SD.CONTROL, "coolant low"]
#FLUSH WAIT
#MSG ["written"]
M30
