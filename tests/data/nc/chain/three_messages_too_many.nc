; A queue of three elements holds two messages.
SSDQInit[SD.CONTROL]
SSDQ[SD.ALARMS, SD.CONTROL, "1"]
SSDQ[SD.ALARMS, SD.CONTROL, "2"]
SSDQ[SD.ALARMS, SD.CONTROL, "3"]
M30
