#pragma once
#include <fieldmark/core/worst.h>

using fieldmark::raise_to;
