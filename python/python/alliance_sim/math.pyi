"""Mathematical functions with the same bits on every machine, for runs that are compared between machines.

Python's `math` may differ in the last bit between machines. These functions return NaN or an infinity, by IEEE 754, in cases where
`math` raises an error.
"""

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

def acos(x: float) -> float:
    """Returns the arc cosine of x, rad, from 0 to pi."""

def asin(x: float) -> float:
    """Returns the arc sine of x, rad, from -pi/2 to pi/2."""

def atan(x: float) -> float:
    """Returns the arc tangent of x, rad, from -pi/2 to pi/2."""

def atan2(y: float, x: float) -> float:
    """Returns the angle of the vector (x, y), rad, from -pi to pi."""

def cbrt(x: float) -> float:
    """Returns the cube root of x."""

def cos(x: float) -> float:
    """Returns the cosine of x, rad."""

def cosh(x: float) -> float:
    """Returns the hyperbolic cosine of x."""

def exp(x: float) -> float:
    """Returns e to the power of x."""

def expm1(x: float) -> float:
    """Returns e to the power of x, less 1, exact also near 0."""

def hypot(x: float, y: float) -> float:
    """Returns the length of the vector (x, y)."""

def log(x: float) -> float:
    """Returns the natural logarithm of x."""

def log10(x: float) -> float:
    """Returns the logarithm of x to the base of 10."""

def log1p(x: float) -> float:
    """Returns the natural logarithm of 1 + x, exact also near 0."""

def log2(x: float) -> float:
    """Returns the logarithm of x to the base of 2."""

def pow(x: float, y: float) -> float:
    """Returns x to the power of y."""

def sin(x: float) -> float:
    """Returns the sine of x, rad."""

def sinh(x: float) -> float:
    """Returns the hyperbolic sine of x."""

def sqrt(x: float) -> float:
    """Returns the square root of x."""

def tan(x: float) -> float:
    """Returns the tangent of x, rad."""

def tanh(x: float) -> float:
    """Returns the hyperbolic tangent of x."""
