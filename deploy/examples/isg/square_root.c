/* A service as one writes it for the vendor's SDK: nothing in here knows of millrace. Form and
 * names are those of the sample in the vendor's manual
 * (IB/tf5200_service_interface/356533387.html); it compiles as C and as C++.
 *
 *   cc -o square_root square_root.c $(pkg-config --cflags --libs millrace-sdk) -lm
 *   MILLRACE_DOMAIN=0 ./square_root
 */
#include "isg_service.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

ISG_SERVICE_CODE squareRoot(ISG_SERVICE* service, char* request, ADS_UINT32 requestState,
                            char* response, size_t maxResponseSize, ADS_UINT32* responseState) {
  double value = atof(request);

  (void)service;
  (void)requestState;
  if (value < 0.0) {
    sprintf_s(response, maxResponseSize, "ERROR: cannot calc square root of negative number %f",
              value);
    *responseState = 99;
  } else {
    sprintf_s(response, maxResponseSize, "%f", sqrt(value));
    *responseState = 1;
  }
  return ISG_SERVICE_CODE_OK;
}

int main(void) {
  ISG_SERVICE_CONNECTION connection;
  ISG_SERVICE service;
  ISG_SERVICE_CODE code;

  code = isgServiceConnectionCreateADSLocal(552, 553, &connection);
  if (code != ISG_SERVICE_CODE_OK) {
    printf("Cannot create the connection: %d\n", (int)code);
    return EXIT_FAILURE;
  }

  code = isgServiceCreate("560AACBF-6335-44a9-895A-8B27F3ED5E47", "Calculates square roots",
                          squareRoot, &connection, &service);
  if (code != ISG_SERVICE_CODE_OK) {
    printf("Cannot create the service: %d\n", (int)code);
    return EXIT_FAILURE;
  }

  isgServicePoll(&service);
  return EXIT_SUCCESS;
}
