"""The service of services/template in Python."""

import millrace


@millrace.service("9d2c5f2e-1a70-4a1c-8a3e-5f2f5b1f7c03", name="length")
def length(call):
    return str(len(call.text))


millrace.run()
