(A plate: its outline with one round corner, and a round pocket)
G21 G90 G17
G0 X5 Y5
G1 Z-1 F300
G1 X25 F1200
X30 Y10
Y20
G3 X25 Y25 I-5 J0
G1 X5
Y5
G0 Z2
X20 Y15
G1 Z-0.5 F300
G2 I-5 J0 F900
G0 Z2
X0 Y0
M30
