/* What rclcpp, rcl and rmw emit, by the functions of libtracetools.so: a program that includes this
 * is traced as a node in C++, and needs nothing of ROS 2. Handles are addresses of fields.
 */
#include <stdbool.h>
#include <stdint.h>
#include <time.h>

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

struct node { char node, rmw; };
struct publisher { char pub, rmw, message; };
struct subscription { char sub, rmw, subscription, callback, message; };
struct timer { char timer, callback; };

static inline int64_t now(clockid_t clock) {
    struct timespec at;
    clock_gettime(clock, &at);
    return at.tv_sec * SECOND + at.tv_nsec;
}

static inline void sleep_until(int64_t at) {
    struct timespec until = {at / SECOND, at % SECOND};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
}

static inline void make_node(struct node *n, const char *name) {
    ros_trace_rcl_node_init(&n->node, &n->rmw, name, "/");
}

/* Its number tells it from others of all processes. */
static inline void make_publisher(struct publisher *p, struct node *n, const char *topic, int number) {
    uint8_t gid[16] = {number, number >> 8, 1};
    ros_trace_rmw_publisher_init(&p->rmw, gid);
    ros_trace_rcl_publisher_init(&p->pub, &n->node, &p->rmw, topic, 10);
}

static inline void make_subscription(struct subscription *s, struct node *n, const char *topic,
                                     const char *function, int number) {
    uint8_t gid[16] = {number, number >> 8, 2};
    ros_trace_rmw_subscription_init(&s->rmw, gid);
    ros_trace_rcl_subscription_init(&s->sub, &n->node, &s->rmw, topic, 10);
    ros_trace_rclcpp_subscription_init(&s->sub, &s->subscription);
    ros_trace_rclcpp_subscription_callback_added(&s->subscription, &s->callback);
    ros_trace_rclcpp_callback_register(&s->callback, function);
}

static inline void make_timer(struct timer *t, struct node *n, int64_t period, const char *function) {
    ros_trace_rcl_timer_init(&t->timer, period);
    ros_trace_rclcpp_timer_callback_added(&t->timer, &t->callback);
    ros_trace_rclcpp_callback_register(&t->callback, function);
    ros_trace_rclcpp_timer_link_node(&t->timer, &n->node);
}

static inline void execute(handle entity) {
    ros_trace_rclcpp_executor_get_next_ready();
    ros_trace_rclcpp_executor_execute(entity);
}

/* Returns the stamp of the message. */
static inline int64_t publish(struct publisher *p) {
    int64_t stamp = now(CLOCK_REALTIME);
    ros_trace_rclcpp_publish(&p->message);
    ros_trace_rcl_publish(&p->pub, &p->message);
    ros_trace_rmw_publish(&p->rmw, &p->message, stamp);
    return stamp;
}

static inline void start_timer_callback(struct timer *t) {
    execute(&t->timer);
    ros_trace_callback_start(&t->callback, false);
}

static inline void take_and_start_callback(struct subscription *s, int64_t stamp) {
    execute(&s->sub);
    ros_trace_rmw_take(&s->rmw, &s->message, stamp, true);
    ros_trace_rcl_take(&s->message);
    ros_trace_rclcpp_take(&s->message);
    ros_trace_callback_start(&s->callback, false);
}
