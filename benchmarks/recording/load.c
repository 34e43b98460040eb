/* A robot that makes events of ROS 2 at a given rate: /source_N -> /filter_N -> /sink_N.
 *
 *     load PATHS EVENTS_PER_SECOND SECONDS [SLOW_SECONDS SLOW_EVERY]
 *
 * Each path is a process with three nodes and one thread. A timer publishes, the filter answers, the
 * sink hears it. In the last SLOW_SECONDS of each SLOW_EVERY seconds the filter of path 0 takes
 * 100 ms. It calls the functions of libtracetools.so, as ROS 2 does, and needs nothing else of it.
 */
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define EVENTS_OF_FLOW 27
#define SECOND 1000000000LL
typedef const void *handle;

void ros_trace_rcl_init(handle context);
void ros_trace_rcl_node_init(handle node, handle rmw, const char *name, const char *space);
void ros_trace_rmw_publisher_init(handle rmw, const uint8_t *gid);
void ros_trace_rcl_publisher_init(handle pub, handle node, handle rmw, const char *topic, int64_t depth);
void ros_trace_rmw_subscription_init(handle rmw, const uint8_t *gid);
void ros_trace_rcl_subscription_init(handle sub, handle node, handle rmw, const char *topic, int64_t depth);
void ros_trace_rclcpp_subscription_init(handle sub, handle subscription);
void ros_trace_rclcpp_subscription_callback_added(handle subscription, handle callback);
void ros_trace_rclcpp_callback_register(handle callback, const char *symbol);
void ros_trace_rcl_timer_init(handle timer, int64_t period);
void ros_trace_rclcpp_timer_callback_added(handle timer, handle callback);
void ros_trace_rclcpp_timer_link_node(handle timer, handle node);
void ros_trace_rclcpp_publish(handle message);
void ros_trace_rcl_publish(handle pub, handle message);
void ros_trace_rmw_publish(handle rmw, handle message, int64_t timestamp);
void ros_trace_rmw_take(handle rmw, handle message, int64_t timestamp, bool taken);
void ros_trace_rcl_take(handle message);
void ros_trace_rclcpp_take(handle message);
void ros_trace_callback_start(handle callback, bool is_intra_process);
void ros_trace_callback_end(handle callback);
void ros_trace_rclcpp_executor_wait_for_work(int64_t timeout);
void ros_trace_rclcpp_executor_get_next_ready(void);
void ros_trace_rclcpp_executor_execute(handle entity);

/* Handles are addresses: of these fields. */
static char context, timer, timer_callback, message;
static struct node { char node, rmw; } source, filter, sink;
static struct publisher { char pub, rmw; } scan, filtered;
static struct subscription { char sub, rmw, subscription, callback; } heard, shown;

static int64_t now(clockid_t clock) {
    struct timespec at;
    clock_gettime(clock, &at);
    return at.tv_sec * SECOND + at.tv_nsec;
}

static void sleep_until(int64_t at) {
    struct timespec until = {at / SECOND, at % SECOND};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
}

static const char *named(const char *name, int path) {
    static char text[64];
    return snprintf(text, sizeof text, "%s_%d", name, path), text;
}

static void make_node(struct node *n, const char *name, int path) {
    ros_trace_rcl_node_init(&n->node, &n->rmw, named(name, path), "/");
}

static void make_publisher(struct publisher *p, struct node *n, const char *topic, int path) {
    uint8_t gid[16] = {path, p == &scan};
    ros_trace_rmw_publisher_init(&p->rmw, gid);
    ros_trace_rcl_publisher_init(&p->pub, &n->node, &p->rmw, named(topic, path), 10);
}

static void make_subscription(struct subscription *s, struct node *n, const char *topic, int path) {
    uint8_t gid[16] = {path, 2 + (s == &heard)};
    ros_trace_rmw_subscription_init(&s->rmw, gid);
    ros_trace_rcl_subscription_init(&s->sub, &n->node, &s->rmw, named(topic, path), 10);
    ros_trace_rclcpp_subscription_init(&s->sub, &s->subscription);
    ros_trace_rclcpp_subscription_callback_added(&s->subscription, &s->callback);
    ros_trace_rclcpp_callback_register(&s->callback, "hear");
}

static void begin(handle entity) {
    ros_trace_rclcpp_executor_wait_for_work(-1);
    ros_trace_rclcpp_executor_get_next_ready();
    ros_trace_rclcpp_executor_execute(entity);
}

static int64_t publish(struct publisher *p) {
    int64_t stamp = now(CLOCK_REALTIME);
    ros_trace_rclcpp_publish(&message);
    ros_trace_rcl_publish(&p->pub, &message);
    ros_trace_rmw_publish(&p->rmw, &message, stamp);
    return stamp;
}

static void take(struct subscription *s, int64_t stamp) {
    begin(&s->sub);
    ros_trace_rmw_take(&s->rmw, &message, stamp, true);
    ros_trace_rcl_take(&message);
    ros_trace_rclcpp_take(&message);
    ros_trace_callback_start(&s->callback, false);
}

static void run(int path, int64_t period, int64_t first, int64_t end, int64_t slow, int64_t every) {
    ros_trace_rcl_init(&context);
    make_node(&source, "source", path);
    make_node(&filter, "filter", path);
    make_node(&sink, "sink", path);
    make_publisher(&scan, &source, "/scan", path);
    make_publisher(&filtered, &filter, "/filtered", path);
    make_subscription(&heard, &filter, "/scan", path);
    make_subscription(&shown, &sink, "/filtered", path);
    ros_trace_rcl_timer_init(&timer, period);
    ros_trace_rclcpp_timer_callback_added(&timer, &timer_callback);
    ros_trace_rclcpp_callback_register(&timer_callback, "tick");
    ros_trace_rclcpp_timer_link_node(&timer, &source.node);
    for (int64_t due = first; due < end; due += period) {
        sleep_until(due);
        begin(&timer);
        ros_trace_callback_start(&timer_callback, false);
        int64_t stamp = publish(&scan);
        ros_trace_callback_end(&timer_callback);
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
