"""Mathematical functions with the same bits on every machine, for runs that are compared between machines.

Python's `math` may differ in the last bit between machines. These functions return NaN or an infinity, by IEEE 754, in cases where
`math` raises an error.
"""

from ._engine import math as _math

__all__ = [
    "acos",
    "asin",
    "atan",
    "atan2",
    "cbrt",
    "cos",
    "cosh",
    "exp",
    "expm1",
    "hypot",
    "log",
    "log10",
    "log1p",
    "log2",
    "pow",
    "sin",
    "sinh",
    "sqrt",
    "tan",
    "tanh",
]

acos = _math.acos
asin = _math.asin
atan = _math.atan
atan2 = _math.atan2
cbrt = _math.cbrt
cos = _math.cos
cosh = _math.cosh
exp = _math.exp
expm1 = _math.expm1
hypot = _math.hypot
log = _math.log
log10 = _math.log10
log1p = _math.log1p
log2 = _math.log2
pow = _math.pow
sin = _math.sin
sinh = _math.sinh
sqrt = _math.sqrt
tan = _math.tan
tanh = _math.tanh
