#pragma once
#define PLUGINLIB_EXPORT_CLASS(own, base) \
  extern "C" base * made() { return new own; }
