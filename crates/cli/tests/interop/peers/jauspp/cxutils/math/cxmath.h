#ifndef CXUTILS_MATH_CXMATH_H
#define CXUTILS_MATH_CXMATH_H

#include <cmath>

namespace CxUtils {

const double CX_PI = 3.14159265358979323846;
const double CX_EPSILON = 1e-12;

inline double CxToDegrees(double radians)
{
    return radians * 180 / CX_PI;
}

inline double CxToRadians(double degrees)
{
    return degrees * CX_PI / 180;
}

} // namespace CxUtils

#endif
