"""The sample service of the controller's manual, in Python; for tests."""

import math

import millrace


@millrace.service("560aacbf-6335-44a9-895a-8b27f3ed5e47", name="square_root")
def square_root(call):
    """Answers a number with its square root."""
    number = float(call.text)
    if number < 0:
        return f"ERROR: cannot calc square root of negative number {number:f}", 99
    return f"{math.sqrt(number):f}"


millrace.run()
