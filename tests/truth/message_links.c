/* A node that keeps messages until its timer fires, and one that waits for a message of each topic:
 * both declare that as a node in C++ does, by the tracepoints of ros2_tracing.
 */
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#define LTTNG_UST_TRACEPOINT_DEFINE
#include "message_links_tp.h"
#include "../../benchmarks/recording/rclcpp.h"
#define ROUNDS 40

static struct node source, planner, fusion, sink;
static struct publisher a, b, plan, fused;
static struct subscription planner_a, planner_b, fusion_a, fusion_b, sink_plan, sink_fused;
static struct timer source_timer, planner_timer;

static void take(struct subscription *s, int64_t stamp) {
    take_and_start_callback(s, stamp);
    ros_trace_callback_end(&s->callback);
}

int main(void) {
    ros_trace_rcl_init(&source);
    make_node(&source, "source");
    make_timer(&source_timer, &source, SECOND / 100, "Source::tick");
    make_publisher(&a, &source, "/a", 1);
    make_publisher(&b, &source, "/b", 2);
    make_node(&planner, "planner");
    make_subscription(&planner_a, &planner, "/a", "Planner::on_a", 1);
    make_subscription(&planner_b, &planner, "/b", "Planner::on_b", 2);
    make_timer(&planner_timer, &planner, SECOND / 50, "Planner::plan");
    make_publisher(&plan, &planner, "/plan", 3);
    make_node(&fusion, "fusion");
    make_subscription(&fusion_a, &fusion, "/a", "Fusion::on_a", 3);
    make_subscription(&fusion_b, &fusion, "/b", "Fusion::on_b", 4);
    make_publisher(&fused, &fusion, "/fused", 4);
    make_node(&sink, "sink");
    make_subscription(&sink_plan, &sink, "/plan", "Sink::on_plan", 5);
    make_subscription(&sink_fused, &sink, "/fused", "Sink::on_fused", 6);

    handle planner_subs[] = {&planner_a.sub, &planner_b.sub}, planner_pubs[] = {&plan.pub};
    lttng_ust_tracepoint(ros2, message_link_periodic_async, planner_subs, 2, planner_pubs, 1);
    handle fusion_subs[] = {&fusion_a.sub, &fusion_b.sub}, fusion_pubs[] = {&fused.pub};
    lttng_ust_tracepoint(ros2, message_link_partial_sync, fusion_subs, 2, fusion_pubs, 1);

    for (int round = 0; round < ROUNDS; round++) {
        ros_trace_rclcpp_executor_wait_for_work(-1);
        sleep_until(now(CLOCK_MONOTONIC) + SECOND / 100);
        start_timer_callback(&source_timer);
        int64_t stamp_a = publish(&a), stamp_b = publish(&b);
        ros_trace_callback_end(&source_timer.callback);
        take(&planner_a, stamp_a);
        take(&planner_b, stamp_b);
        take(&fusion_a, stamp_a);
        take_and_start_callback(&fusion_b, stamp_b);
        int64_t stamp_fused = publish(&fused);
        ros_trace_callback_end(&fusion_b.callback);
        take(&sink_fused, stamp_fused);
        if (round % 2) {
            start_timer_callback(&planner_timer);
            int64_t stamp_plan = publish(&plan);
            ros_trace_callback_end(&planner_timer.callback);
            take(&sink_plan, stamp_plan);
        }
    }
}
