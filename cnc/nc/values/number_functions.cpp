#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "cnc/nc/values/operations.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::values {
namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double near_zero = 1e-12;

// Makes a function of one number from a C++ function.
template <double (*function)(double)>
Result<Value> of_number(Arguments arguments) {
  return number(arguments[0]).and_then([](double x) { return finite(function(x)); });
}

template <double (*function)(double, double)>
Result<Value> of_two(Arguments arguments) {
  const auto left = number(arguments[0]);
  const auto right = number(arguments[1]);
  if (!left || !right) {
    return tl::make_unexpected(left ? right.error() : left.error());
  }
  return finite(function(*left, *right));
}

// Multiples of 90 degrees are exact: COS[90] is 0 in the manual.
double clean(double value) {
  return std::abs(value) < near_zero ? 0.0 : value;
}
double sine(double x) {
  return clean(std::sin(x * degree));
}
double cosine(double x) {
  return clean(std::cos(x * degree));
}
double arc_sine(double x) {
  return std::asin(x) / degree;
}
double arc_cosine(double x) {
  return std::acos(x) / degree;
}
double arc_tangent(double x) {
  return std::atan(x) / degree;
}
double arc_cotangent(double x) {
  return 90.0 - std::atan(x) / degree;
}
double arc_tangent_2(double y, double x) {
  return std::atan2(y, x) / degree;
}
double square(double x) {
  return x * x;
}
double power_of_ten(double x) {
  return std::pow(10.0, x);
}
double truncate(double x) {
  return std::trunc(x);
}
double fraction(double x) {
  return x - std::trunc(x);
}
double nearest(double x) {
  return std::round(x);
}
double sign(double x) {
  return x > 0 ? 1.0 : (x < 0 ? -1.0 : 0.0);
}
double least(double a, double b) {
  return std::min(a, b);
}
double greatest(double a, double b) {
  return std::max(a, b);
}
double negation(double x) {
  return is_true(x) ? 0.0 : 1.0;
}

// A quotient whose divisor may be zero.
Result<Value> quotient(double dividend, double divisor, const char* function) {
  if (divisor == 0) {
    return fault(20396, std::string("division by zero in ") + function);
  }
  return finite(dividend / divisor);
}

Result<Value> tangent(Arguments arguments) {
  return number(arguments[0]).and_then([](double x) {
    return quotient(sine(x), cosine(x), "TAN");
  });
}

Result<Value> cotangent(Arguments arguments) {
  return number(arguments[0]).and_then([](double x) {
    return quotient(cosine(x), sine(x), "COT");
  });
}

template <double (*function)(double)>
Result<Value> of_unit_interval(Arguments arguments) {
  return number(arguments[0]).and_then([](double x) -> Result<Value> {
    if (std::abs(x) > 1) {
      return fault(0, "the argument " + display(x) + " of ASIN or ACOS is not between -1 and 1");
    }
    return function(x);
  });
}

Result<Value> square_root(Arguments arguments) {
  return number(arguments[0]).and_then([](double x) -> Result<Value> {
    if (x < 0) {
      return fault(0, "SQRT of the negative number " + display(x));
    }
    return std::sqrt(x);
  });
}

template <double (*function)(double)>
Result<Value> logarithm(Arguments arguments) {
  return number(arguments[0]).and_then([](double x) -> Result<Value> {
    if (x <= 0) {
      return fault(20399, "logarithm of " + display(x) + ", which is not above zero");
    }
    return function(x);
  });
}

Result<Value> inverted_bits(Arguments arguments) {
  return integer(arguments[0]).map([](long x) -> Value { return static_cast<double>(~x); });
}

constexpr std::array<Function, 26> number_table = {{
    {"ABS", 1, 1, of_number<std::fabs>},
    {"SQR", 1, 1, of_number<square>},
    {"SQRT", 1, 1, square_root},
    {"EXP", 1, 1, of_number<std::exp>},
    {"LN", 1, 1, logarithm<std::log>},
    {"DEXP", 1, 1, of_number<power_of_ten>},
    {"LOG", 1, 1, logarithm<std::log10>},
    {"SIN", 1, 1, of_number<sine>},
    {"COS", 1, 1, of_number<cosine>},
    {"TAN", 1, 1, tangent},
    {"COT", 1, 1, cotangent},
    {"ASIN", 1, 1, of_unit_interval<arc_sine>},
    {"ACOS", 1, 1, of_unit_interval<arc_cosine>},
    {"ATAN", 1, 1, of_number<arc_tangent>},
    {"ACOT", 1, 1, of_number<arc_cotangent>},
    {"ATAN2", 2, 2, of_two<arc_tangent_2>},
    {"INT", 1, 1, of_number<truncate>},
    {"FRACT", 1, 1, of_number<fraction>},
    {"ROUND", 1, 1, of_number<nearest>},
    {"CEIL", 1, 1, of_number<std::ceil>},
    {"FLOOR", 1, 1, of_number<std::floor>},
    {"SIGN", 1, 1, of_number<sign>},
    {"MIN", 2, 2, of_two<least>},
    {"MAX", 2, 2, of_two<greatest>},
    {"NOT", 1, 1, of_number<negation>},
    {"INV", 1, 1, inverted_bits},
}};

}  // namespace

std::span<const Function> number_functions() {
  return number_table;
}

}  // namespace millrace::cnc::nc::values
