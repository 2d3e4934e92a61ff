#include "tcplistensocket.h"
