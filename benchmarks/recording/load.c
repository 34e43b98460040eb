/* A robot that makes events of ROS 2 at a given rate: /source_N -> /filter_N -> /sink_N.
 *
 *     load PATHS EVENTS_PER_SECOND SECONDS [SLOW_SECONDS SLOW_EVERY]
 *
 * Each path is a process with three nodes and one thread. A timer publishes, the filter answers, the
 * sink hears it. In the last SLOW_SECONDS of each SLOW_EVERY seconds the filter of path 0 takes
 * 100 ms.
 */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include "rclcpp.h"

#define EVENTS_OF_FLOW 27

static char context;
static struct node source, filter, sink;
static struct publisher scan, filtered;
static struct subscription heard, shown;
static struct timer timer;

static const char *named(const char *name, int path) {
    static char text[64];
    return snprintf(text, sizeof text, "%s_%d", name, path), text;
}

static void take(struct subscription *s, int64_t stamp) {
    ros_trace_rclcpp_executor_wait_for_work(-1);
    take_and_start_callback(s, stamp);
}

static void run(int path, int64_t period, int64_t first, int64_t end, int64_t slow, int64_t every) {
    ros_trace_rcl_init(&context);
    make_node(&source, named("source", path));
    make_node(&filter, named("filter", path));
    make_node(&sink, named("sink", path));
    make_publisher(&scan, &source, named("/scan", path), 2 * path);
    make_publisher(&filtered, &filter, named("/filtered", path), 2 * path + 1);
    make_subscription(&heard, &filter, named("/scan", path), "hear", 2 * path);
    make_subscription(&shown, &sink, named("/filtered", path), "hear", 2 * path + 1);
    make_timer(&timer, &source, period, "tick");
    for (int64_t due = first; due < end; due += period) {
        sleep_until(due);
        ros_trace_rclcpp_executor_wait_for_work(-1);
        start_timer_callback(&timer);
        int64_t stamp = publish(&scan);
        ros_trace_callback_end(&timer.callback);
        take(&heard, stamp);
        if (path == 0 && every && (due - first) % every >= every - slow) usleep(100000);
        stamp = publish(&filtered);
        ros_trace_callback_end(&heard.callback);
        take(&shown, stamp);
        ros_trace_callback_end(&shown.callback);
        /* As a timer of ROS does: what it missed meanwhile is left out. */
        int64_t late = now(CLOCK_MONOTONIC) - due;
        if (late > period) due += (late / period - 1) * period;
    }
}

int main(int count, char **words) {
    if (count < 4) return 2;
    int paths = atoi(words[1]);
    int64_t period = paths * EVENTS_OF_FLOW * SECOND / atoll(words[2]);
    int64_t first = now(CLOCK_MONOTONIC) + SECOND, end = first + atoll(words[3]) * SECOND;
    int64_t slow = count > 5 ? atoll(words[4]) * SECOND : 0, every = slow ? atoll(words[5]) * SECOND : 0;
    for (int path = 0; path < paths; path++) {
        if (fork()) continue;
        prctl(PR_SET_NAME, named("path", path));
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        run(path, period, first + path * period / paths, end, slow, every);
        return 0;
    }
    while (wait(NULL) > 0) continue;
    return 0;
}
