/* Tracepoints that write a line each to the file that FAKE_TRACE names. */
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static void say(const char *format, ...) {
  FILE *file = fopen(getenv("FAKE_TRACE"), "a");
  va_list values;
  va_start(values, format);
  vfprintf(file, format, values);
  va_end(values);
  fclose(file);
}

#define ONE(name) void ros_trace_##name(long a) { say(#name " %ld\n", a); }
#define TWO(name) void ros_trace_##name(long a, long b) { say(#name " %ld %ld\n", a, b); }
void ros_trace_callback_start(long a, bool b) { (void)b; say("callback_start %ld\n", a); }
ONE(callback_end)
TWO(rclcpp_subscription_init)
TWO(rclcpp_subscription_callback_added)
TWO(rclcpp_timer_callback_added)
TWO(rclcpp_timer_link_node)
TWO(rclcpp_service_callback_added)
void ros_trace_rclcpp_callback_register(long a, const char *b) { say("register %ld %s\n", a, b); }
void ros_trace_rclcpp_executor_get_next_ready(void) { say("ready\n"); }
ONE(rclcpp_executor_wait_for_work)
ONE(rclcpp_executor_execute)
/* Whether a session runs: as long as that file is there. */
bool ros_trace_enabled_callback_start(void) { return !access(getenv("FAKE_SESSION"), F_OK); }
