#MSG ["standard"]
#MSG ISG_DIAG_BED ["diagnosis"]
#MSG DIAG ["diagnosis"]
#MSG HMI ["operator"]
#MSG SYN PLC ["plc"]
#MSG EVENT_LOGGER ["log"]
#MSG INFO HMI ["data %.2f", 1.5]
M30
