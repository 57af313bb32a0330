N10 G01 X100 F6000 (1 s)
N20 X0 F3000       (2 s)
N30 X30 Y40        (50 mm: 1 s)
N40 G91 X30 Y40    (incremental: 1 s)
N50 G90 G00 X0 Y0  (rapid: 100 mm at 10 m/min: 0.6 s)
M30
