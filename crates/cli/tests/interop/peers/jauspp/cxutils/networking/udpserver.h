#include "udpclient.h"
