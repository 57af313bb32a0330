(the decoder is ahead; what it sees is what was executed)
N10 SSDQInit[SD.CTRL]
N20 G01 X100 F6000
N30 SSDQ[SD.QUEUE, SD.CTRL, "one"] X200
N40 #MSG ["decoded: %d", SD.CTRL.LastFilled]
N50 #MSG SYN ["at N50"]
N60 #FLUSH WAIT
N70 #MSG ["executed: %d of %d, '%s'", SD.CTRL.LastFilled, SD.CTRL.LastGet, SD.QUEUE[2]]
N80 P1 = 5 P2 = 1
N90 SSDQ[SD.QUEUE, SD.CTRL, "two " + INT_TO_STR[P1 + P2]]
N100 #FLUSH WAIT
N110 #MSG ["executed: %d, '%s'", SD.CTRL.LastFilled, SD.QUEUE[3]]
N120 M30
