#pragma once

#define TRACTION_EXPORT __attribute__((visibility("default")))
