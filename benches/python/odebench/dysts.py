"""Systems of dysts (Gilpin 2021, arXiv:2110.05266) with three to six states, in the form of `systems.py`.

Those without an input and without a delay whose rates are sums of products of powers, sines, cosines,
exponentials, quotients, and whose motion 512 samples over five of the stated periods resolve. Constants,
starts and periods are those of github.com/williamgilpin/dysts (0.96), starts and periods rounded to six
digits, angles between -pi and pi. A record lasts five periods; the other start is the first, five per cent
larger.

A line of the table below is a name, the period, the start; then the shapes and the states that are angles,
where there are any. Under it stands every state's rate. A factor without a decimal point is a number of the
equation; any other is a constant.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from systems import System, Term

PERIODS = 5  # that a record lasts

_TABLE = """
Aizawa 2.5837 from -0.784502 -0.628877 -0.176203
    x' = x*z - 0.7 x - 3.5 y
    y' = 3.5 x + y*z - 0.7 y
    z' = 0.6 1 + 0.95 z - 0.3333333333333333 z^3 - x^2 - y^2 - 0.25 x^2*z - 0.25 y^2*z + 0.1 x^3*z
Arneodo 3.1641 from -2.75157 0.190798 3.47036
    x' = y
    y' = z
    z' = 5.5 x - 4.5 y - 1.0 z - 1.0 x^3
ArnoldBeltramiChildress 2.8508 from -2.88379 2.77007 -0.208133 angles xyz
    x' = 1.73205 sin(z) + 1.0 cos(y)
    y' = 1.41421 sin(x) + 1.73205 cos(z)
    z' = 1.0 sin(y) + 1.41421 cos(x)
Blasius 6.6038 from 4.03171 5.11138 0.0165088 with k=0.05
    x' = 1.0 x - 0.2 x*y/(1+k*x)
    y' = -1.0 y + 0.2 x*y/(1+k*x) - 1.0 y*z
    z' = 0.06 1 - 10.0 z + 1.0 y*z
Bouali 3.0411 from 0.386732 3.05442 -0.00678362
    x' = 4.0 x - 1.0 x*y + 0.3 z
    y' = -1.0 y + 1.0 x^2*y
    z' = -1.5 x + 1.0 x*z - 0.05 z
Bouali2 7.6779 from -0.793923 1.36176 -0.0305789
    x' = 3.0 x - 3.0 x*y - 2.2 z
    y' = -1.0 y + 1.0 x^2*y
    z' = 0.00400005 x
BurkeShaw 0.78333 from -0.791532 0.652445 0.225178
    x' = -10.0 x - 10.0 y
    y' = y - 10.0 x*z
    z' = 10.0 x*y + 13.0 1
Chen 0.58689 from 3.26897 5.29905 19.4353
    x' = 35.0 y - 35.0 x
    y' = -7.0 x - x*z + 28.0 y
    z' = x*y - 3.0 z
ChenLee 2.8043 from 0.171771 0.103605 6.25539
    x' = 5.0 x - y*z
    y' = -10.0 y + x*z
    z' = -0.38 z + 0.3333333333333333 x*y
Chua 1.4235 from 1.12624 -0.113865 -0.783244
    x' = 15.6 y - 4.457076 x + 3.3428226 abs(x+1) - 3.3428226 abs(x-1)
    y' = x - y + z
    z' = -28.0 y
Coullet 5.7663 from 0.345398 0.42847 0.0869837
    x' = y
    y' = z
    z' = 0.8 x - 1.1 y - 0.45 z - 1.0 x^3
Dadras 3.2886 from 1.02841 -3.53487 -0.720816
    x' = y - 3.0 x + 2.7 y*z
    y' = 1.7 y - x*z + z
    z' = 2.0 x*y - 9.0 z
DequanLi 0.083806 from -11.3957 -104.126 202.462
    x' = 40.0 y - 40.0 x + 0.16 x*z
    y' = 55.0 x + 20.0 y - x*z
    z' = 1.833 z + x*y - 0.65 x^2
Finance 9.8932 from -0.516647 -3.95687 0.00128936
    x' = 4.999 x + z + x*y
    y' = -0.2 y - x^2
    z' = -x - 1.1 z
GenesioTesi 5.9431 from -0.0537726 -0.261626 0.335016
    x' = y
    y' = z
    z' = -1.0 x - 1.1 y - 0.44 z + x^2
GuckenheimerHolmes 0.307692 from -0.555824 0.0518162 0.377661
    x' = 0.4 x - 20.25 y + 3.0 x*z + 1.6 x^2*z + 1.6 y^2*z
    y' = 0.4 y + 20.25 x + 3.0 y*z
    z' = 1.7 1 - z^2 - 0.44 x^2 - 0.44 y^2 - 0.4 z^3
Hadley 1.4541 from 1.36644 0.930915 0.642834
    x' = -y^2 - z^2 - 0.2 x + 1.8 1
    y' = x*y - 4.0 x*z - y + 1.0 1
    z' = 4.0 x*y + x*z - z
Halvorsen 1.4889 from -8.68074 -2.47414 0.0707758
    x' = -1.4 x - 4.0 y - 4.0 z - y^2
    y' = -1.4 y - 4.0 z - 4.0 x - z^2
    z' = -1.4 z - 4.0 x - 4.0 y - x^2
HastingsPowell 135.19 from 0.73207 0.175493 9.90147 with a=3.0 b=2.0
    x' = x - x^2 - 5.0 x*y/(1+a*x)
    y' = 5.0 x*y/(1+a*x) - 0.1 y*z/(1+b*y) - 0.4 y
    z' = 0.1 y*z/(1+b*y) - 0.01 z
HenonHeiles 6.37 from -0.297073 -0.00313675 0.425489 0.0719055
    x' = u
    y' = v
    u' = -x - 2.0 x*y
    v' = -y - 1.0 x^2 + 1.0 y^2
HindmarshRose 1.752 from 0.0311118 -0.0215571 0.041475
    x' = -x + 33.333333333333336 y - 16.333333333333332 x^3 + 33.333333333333336 x^2 + 33.333333333333336 z
    y' = -0.49 x^3 + z
    z' = -1.25 x - 1.25 z + 0.04025 1
HyperBao 0.583151 from 9.27131 9.75225 23.9192 -16.6968
    x' = 36.0 y - 36.0 x + w
    y' = 20.0 y - x*z
    z' = x*y - 3.0 z
    w' = 21.0 x + 0.1 y*z
HyperCai 0.611394 from -10.6913 -15.5412 18.3883 -14.9045
    x' = 27.5 y - 27.5 x
    y' = 3.0 x + 19.3 y - x*z + w
    z' = -2.9 z + y^2
    w' = -3.3 x
HyperJha 0.856447 from 13.7654 20.2038 32.0818 -51.1893
    x' = 10.0 y - 10.0 x + w
    y' = -x*z + 28.0 x - y
    z' = x*y - 2.667 z
    w' = -x*z + 1.3 w
HyperLorenz 1.27755 from -9.18607 -0.674457 16.4405 -145.024
    x' = 10.0 y - 10.0 x + w
    y' = -x*z + 28.0 x - y
    z' = -2.667 z + x*y
    w' = 1.1 w - x*z
HyperLu 0.716286 from 8.11349 10.5566 18.4459 -28.3815
    x' = 36.0 y - 36.0 x + w
    y' = -x*z + 20.0 y
    z' = x*y - 3.0 z
    w' = 1.3 w + x*z
HyperPang 0.843937 from 8.40864 4.6721 27.9103 -1.26301
    x' = 36.0 y - 36.0 x
    y' = -x*z + 20.0 y + w
    z' = x*y - 3.0 z
    w' = -2.0 x - 2.0 y
HyperQi 0.0618604 from 11.2509 -3.64708 50.1699 -168.249
    x' = 50.0 y - 50.0 x + y*z
    y' = 24.0 x + 24.0 y - x*z
    z' = -13.0 z - 33.0 w + x*y
    w' = -8.0 w + 30.0 z + x*y
HyperRossler 1.11575 from -93.6677 15.5078 0.032087 43.7928
    x' = -y - z
    y' = x + 0.25 y + w
    z' = 3.0 1 + x*z
    w' = -0.5 z + 0.05 w
HyperWang 0.648152 from 0.168249 0.168541 37.0403 -15.2903
    x' = 10.0 y - 10.0 x
    y' = -x*z + 40.0 x + w
    z' = -2.5 z + 4.0 x^2
    w' = -10.6 x
HyperXu 1.13282 from 0.689445 -0.602541 -0.581466 0.266293
    x' = 10.0 y - 10.0 x + w
    y' = 40.0 x + 16.0 x*z
    z' = -2.5 z - x*y
    w' = x*z - 2.0 y
HyperYan 0.912703 from -6.57662 -4.61715 17.7965 0.807236
    x' = 37.0 y - 37.0 x
    y' = -11.0 x - x*z + 26.0 y
    z' = -3.0 z + x*y - y*z + x*z - w
    w' = -38.0 w + y*z - x*z
HyperYangChen 0.912703 from 3.53446 4.82853 25.0492 17.1185
    x' = 30.0 y - 30.0 x
    y' = 35.0 x - x*z + w
    z' = -3.0 z + x*y
    w' = -8.0 x
IsothermalChemical 0.73028 from 0.514151 0.998429 1.00618
    x' = 0.74465 1 + 0.29786 z - x*y^2 - x
    y' = 76.92307692307692 x*y^2 + 76.92307692307692 x - 76.92307692307692 y
    z' = 1.0 y - 1.0 z
ItikBanksTumor 49.74 from 0.0517302 0.870716 0.0159264 with a=1.0
    x' = x - x^2 - 1.0 x*y - 2.5 x*z
    y' = 0.6 y - 0.6 y^2 - 1.5 x*y
    z' = 4.5 x*z/(x+a) - 0.2 x*z - 0.5 z
KawczynskiStrizhak 10.9917 from -1.1605 5.86369 -1.20319
    x' = 0.49 y - 0.49 x^3 + 3.087 x
    y' = -4.2 x - y - z - 0.4 1
    z' = 0.2 x - 0.2 z
Laser 0.94667 from -2.5408 -1.94057 -2.9681
    x' = 10.0 y - 10.0 x + 1.0 y*z^2
    y' = 5.0 x - 1.0 x*z^2
    z' = -5.0 z - 6.0 x^2
LiuChen 8.0164 from 4.67228 5.24372e-10 -6.44442e-10
    x' = 0.4 x + 1.0 y*z
    y' = -12.0 y - 1.0 x*z
    z' = -5.0 z - 1.0 x*y
Lorenz 1.5008 from -9.78693 -15.0385 20.534
    x' = 10.0 y - 10.0 x
    y' = 28.0 x - x*z - y
    z' = x*y - 2.667 z
Lorenz84 6.2586 from 1.92648 -0.134021 -1.72147
    x' = -1.32 x - y^2 - z^2 + 6.3756 1
    y' = -y + x*y - 7.91 x*z + 4.194 1
    z' = -z + 7.91 x*y + x*z
Lorenz96 2.1969 from -2.46821 0.0957026 1.59271 10.2137
    x' = y*w - z*w - x + 20.0 1
    y' = x*z - x*w - y + 20.0 1
    z' = y*w - x*y - z + 20.0 1
    w' = x*z - y*z - w + 20.0 1
LorenzBounded 1.3716 from -13.2849 -12.4443 34.1882
    x' = 10.0 y - 10.0 x - 0.00244140625 x^2*y - 0.00244140625 y^3 - 0.00244140625 y*z^2
        + 0.00244140625 x^3 + 0.00244140625 x*y^2 + 0.00244140625 x*z^2
    y' = 28.0 x - x*z - y - 0.0068359375 x^3 - 0.0068359375 x*y^2 - 0.0068359375 x*z^2
        + 0.000244140625 x^3*z + 0.000244140625 x*y^2*z + 0.000244140625 x*z^3 + 0.000244140625 x^2*y
        + 0.000244140625 y^3 + 0.000244140625 y*z^2
    z' = x*y - 2.667 z - 0.000244140625 x^3*y - 0.000244140625 x*y^3 - 0.000244140625 x*y*z^2
        + 0.000651123046875 x^2*z + 0.000651123046875 y^2*z + 0.000651123046875 z^3
LorenzCoupled 1.6207 from 7.09215 10.1174 25.7084 2.16899 0.961219 0.895502
    x' = 10.0 y - 10.0 x
    y' = 35.0 x - x*z - y
    z' = x*y - 2.667 z
    u' = 10.0 v - 12.85 u + 2.85 x
    v' = 1.15 u - u*w - v
    w' = u*v - 2.667 w
LorenzStenflo 3.88771 from 4.23344 9.08971 21.8666 -1.40807
    x' = 2.0 y - 2.0 x + 1.5 w
    y' = 26.0 x - x*z - y
    z' = x*y - 0.7 z
    w' = -x - 2.0 w
LuChen 2.3385 from 10.9565 9.88131 22.6767
    x' = 36.0 y - 36.0 x
    y' = -x*z + 18.0 y
    z' = x*y - 3.0 z
LuChenCheng 0.92333 from -5.51776 2.49906 10.4618
    x' = 2.857142857142857 x - y*z + 18.1 1
    y' = -10.0 y + x*z
    z' = -4.0 z + x*y
MooreSpiegel 1.2887 from -3.47333 19.667 -3.82625
    x' = y
    y' = 10.0 z
    z' = -z + 9.0 y - x^2*y - 4.0 x
NewtonLiepnik 8.5095 from 0.294308 0.106495 0.290811
    x' = -0.4 x + y + 10 y*z
    y' = -x - 0.4 y + 5 x*z
    z' = 0.175 z - 5 x*y
NoseHoover 5.8673 from -1.97586 0.246475 0.790243
    x' = y
    y' = -x + y*z
    z' = 1.5 1 - y^2
NuclearQuadrupole 6.02308 from -0.855912 1.48078 -0.850753 1.63576
    x' = 1.0 u
    y' = 1.0 v
    u' = -1.0 x + 1.16672619 x^2 - 1.16672619 y^2 - 0.4 x^3 - 0.4 x*y^2
    v' = -1.0 y - 2.33345238 x*y - 0.4 x^2*y - 0.4 y^3
PanXuZhou 1.7829 from -3.03806 -1.98052 14.6567
    x' = 10.0 y - 10.0 x
    y' = 16.0 x - x*z
    z' = -2.6667 z + x*y
PehlivanWei 3.74873 from 0.216656 0.867105 0.506279
    x' = y - y*z
    y' = y + y*z - 2 x
    z' = 2 1 - x*y - y^2
Qi 0.40821 from 0.256204 0.195612 7.25982 1.31626
    x' = 45.0 y - 45.0 x + y*z*w
    y' = 10.0 x + 10.0 y - x*z*w
    z' = -1.0 z + x*y*w
    w' = -10.0 w + x*y*z
QiChen 0.39179 from 17.4209 5.54596 78.8914
    x' = 38.0 y - 38.0 x + y*z
    y' = 80.0 x + y - x*z
    z' = x*y - 2.666 z
RabinovichFabrikant 2.3356 from -1.82073 0.834409 0.207825
    x' = y*z - y + x^2*y + 0.87 x
    y' = 3 x*z + x - x^3 + 0.87 y
    z' = -2.2 z - 2 x*y*z
RayleighBenard 0.91967 from -15.6606 -13.3202 26.8794
    x' = 30.0 y - 30.0 x
    y' = 18.0 y - x*z
    z' = x*y - 5.0 z
RikitakeDynamo 5.8975 from -0.779156 -0.630224 2.6712
    x' = -1.0 x + y*z
    y' = -1.0 y - 1.0 x + x*z
    z' = 1 1 - x*y
Rossler 5.9086 from 6.51344 0.477201 0.341643
    x' = -y - z
    y' = x + 0.2 y
    z' = 0.2 1 + x*z - 5.7 z
Rucklidge 6.0721 from 1.92572 3.19238 5.78297
    x' = -2.0 x + 6.7 y - y*z
    y' = x
    z' = -z + y^2
Sakarya 4.9844 from -2.8976 3.8878 3.07465
    x' = -1.0 x + 1.0 y + 1.0 y*z
    y' = -1.0 y - 1.0 x + 0.4 x*z
    z' = 1.0 z - 0.3 x*y
SaltonSea 0.96738 from 231.925 89.5119 56.7538 with a=15.0
    x' = 22.0 x - 0.055 x^2 - 0.115 x*y
    y' = 0.06 x*y - 15.5 y*z/(y+a) - 3.4 y
    z' = 10.0 y*z/(y+a) - 8.3 z
ShimizuMorioka 12.038 from 0.0168387 0.0348938 0.353468
    x' = y
    y' = x - 0.85 y - x*z
    z' = -0.5 z + x^2
SprottA 6.37285 from 1.54132 1.4308 -1.52555
    x' = y
    y' = -x + y*z
    z' = 1 1 - y^2
SprottB 11.0501 from 1.68783 1.48481 -0.537066
    x' = y*z
    y' = x - y
    z' = 1 1 - x*y
SprottC 8.8852 from -0.471998 -0.271981 1.94182
    x' = y*z
    y' = x - y
    z' = 1 1 - x^2
SprottD 4.8333 from -1.33969 -0.212383 0.329822
    x' = -y
    y' = x + z
    z' = x*z + 3 y^2
SprottE 7.6275 from 0.617376 0.665993 -1.6575
    x' = y*z
    y' = x^2 - y
    z' = 1 1 - 4 x
SprottF 19.244 from -0.989413 -1.41917 0.857972
    x' = y + z
    y' = -x + 0.5 y
    z' = x^2 - z
SprottG 8.7097 from -0.771825 -0.747566 1.30733
    x' = 0.4 x + z
    y' = x*z - y
    z' = -x + y
SprottH 20.229 from -1.36004 0.625854 -1.27882
    x' = -y + z^2
    y' = x + 0.5 y
    z' = x - z
SprottI 10.93 from -0.0600994 -0.495584 0.023159
    x' = -0.2 y
    y' = x + z
    z' = x + y^2 - z
SprottJ 4.836 from 4.47869 2.29774 6.58471
    x' = 2 z
    y' = -2 y + z
    z' = -x + y + y^2
SprottJerk 11.921 from -0.541061 0.593832 0.451272
    x' = y
    y' = z
    z' = -x + y^2 - 2.017 z
SprottK 7.006 from -1.3165 -1.543 0.664053
    x' = x*y - z
    y' = x - y
    z' = x + 0.3 z
SprottL 6.7262 from 4.36116 13.7056 -2.68357
    x' = y + 3.9 z
    y' = 0.9 x^2 - y
    z' = 1 1 - x
SprottM 5.3644 from 1.60244 -1.59832 -2.62364
    x' = -z
    y' = -x^2 - y
    z' = 1.7 1 + 1.7 x + y
SprottN 4.8135 from -8.32587 7.30337 3.27989
    x' = -2 y
    y' = x + z^2
    z' = 1 1 + y - 2 z
SprottO 9.755 from 0.205495 0.022793 0.936369
    x' = y
    y' = x - z
    z' = x + x*z + 2.7 y
SprottP 5.3414 from 0.834207 0.149158 0.440286
    x' = 2.7 y + z
    y' = -x + y^2
    z' = x + y
SprottQ 4.8443 from 2.9781 -0.0652607 -2.80313
    x' = -z
    y' = x - y
    z' = 3.1 x + y^2 + 0.5 z
SprottR 7.0133 from -1.69149 -1.97837 1.98078
    x' = 0.9 1 - y
    y' = 0.4 1 + z
    z' = x*y - z
SprottS 3.3505 from 0.126357 0.122607 1.22154
    x' = -x - 4 y
    y' = x + z^2
    z' = 1 1 + x
SprottTorus 13.607 from 0.688348 -0.180176 0.585397
    x' = y + 2 x*y + x*z
    y' = 1 1 - 2 x^2 + y*z
    z' = x - x^2 - y^2
Thomas 4.969 from 2.19944 2.36342 3.2202
    x' = -1.85 x + 10.0 sin(y)
    y' = -1.85 y + 10.0 sin(z)
    z' = -1.85 z + 10.0 sin(x)
ThomasLabyrinth 6.05 from -4.95995 1.0302 -4.68839
    x' = -0.5 x + 10.0 sin(y)
    y' = -0.5 y + 10.0 sin(z)
    z' = -0.5 z + 10.0 sin(x)
Tsucs2 0.34526 from 1.29699 1.12138 50.029
    x' = 40.0 y - 40.0 x + 0.5 x*z
    y' = 20.0 y - x*z
    z' = 0.833 z + x*y - 0.65 x^2
VallisElNino 2.2087 from -6.99286 0.0232543 -0.165818
    x' = 102.0 y - 3.0 x
    y' = -y + x*z
    z' = -z - x*y + 1 1
WangSun 26.958 from -0.547708 0.738765 -0.00492845
    x' = 0.2 x + 1.0 y*z
    y' = -0.01 x - 0.4 y - x*z
    z' = -1.0 z - 1.0 x*y
YuWang 1.3366 from -0.214224 -0.179355 14.1055
    x' = 10.0 y - 10.0 x
    y' = 40.0 x - 2.0 x*z
    z' = exp(x*y) - 2.5 z
YuWang2 0.39265 from 0.125815 1.24673 18.3586
    x' = 10.0 y - 10.0 x
    y' = 30.0 x - 2.0 x*z
    z' = 0.5 exp(x*y) + 0.5 exp(-x*y) - 2.5 z
ZhouChen 0.87518 from -0.603902 0.012112 0.000832779
    x' = 2.97 x + 0.15 y + y*z
    y' = -3.0 y - x*z + y*z
    z' = -8.78 z - x*y
"""


def _terms(text: str) -> Iterator[Term]:
    """Factors and functions of a rate; signs between terms have blanks on both sides."""
    parts = re.split(r" ([+-]) ", text)
    for sign, part in zip(["+", *parts[1::2]], parts[::2], strict=True):
        given, _, function = part.rpartition(" ")
        if function.startswith("-") and not given:
            given, function = "-1", function[1:]
        number = float(given) if "." in given or "e" in given else int(given or 1)
        yield (number if sign == "+" else -number), function


def _read(table: str) -> Iterator[System]:
    """The systems, numbered in their order."""
    blocks = re.findall(r"^(\w+) (\S+) from (.*)\n((?: .*\n)+)", table, flags=re.MULTILINE)
    for number, (title, period, rest, body) in enumerate(blocks, 1):
        start, _, angles = rest.partition(" angles ")
        start, _, shapes = start.partition(" with ")
        first = tuple(float(x) for x in start.split())
        rates = re.sub(r"\n {8}", " ", body).strip().splitlines()
        yield System(
            number,
            title,
            {rate.strip()[0]: tuple(_terms(rate.partition("= ")[2])) for rate in rates},
            (first, tuple(1.05 * x for x in first)),
            {name: float(value) for name, value in (one.split("=") for one in shapes.split())},
            angles,
            PERIODS * float(period),
        )


DYSTS = {one.number: one for one in _read(_TABLE)}
