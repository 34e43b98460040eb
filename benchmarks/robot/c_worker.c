/* One process of the robot of worker.py, with the events of rclcpp.
 *
 *     c_worker PROCESS [PROBLEM]
 *
 * A message is its stamp, sent to a socket of this directory. Each callback group of the worker has
 * a thread, as in an executor of several threads.
 */
#define _GNU_SOURCE
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "../recording/rclcpp.h"

#define MILLISECOND 1000000LL
#define PERIOD (100 * MILLISECOND)
#define WORK (20 * MILLISECOND)

static const char *problem = "";
static char context;
static struct node node;
static struct publisher image, scan, result;
static struct timer timer;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int truth, sender;

static bool is(const char *planted) {
    return strcmp(problem, planted) == 0;
}

static void compute(int64_t length) {
    int64_t end = now(CLOCK_THREAD_CPUTIME_ID) + length;
    while (now(CLOCK_THREAD_CPUTIME_ID) < end)
        for (volatile int count = 0; count < 10000; count++) continue;
}

static void pause_for(int64_t length) {
    sleep_until(now(CLOCK_MONOTONIC) + length);
}

static void write_to_disk(int64_t length) {
    static const char zeros[1 << 18];
    int64_t end = now(CLOCK_MONOTONIC) + length;
    int file = open("written", O_WRONLY | O_CREAT | O_TRUNC, 0644);
    while (now(CLOCK_MONOTONIC) < end)
        if (write(file, zeros, sizeof zeros) < 0 || fsync(file)) _exit(1);
    close(file);
}

static struct sockaddr_un place(const char *topic) {
    struct sockaddr_un at = {.sun_family = AF_UNIX};
    snprintf(at.sun_path, sizeof at.sun_path, "%s.socket", topic + 1);
    return at;
}

/* A message that finds no room is lost. */
static void send_on(const char *topic, struct publisher *p) {
    struct sockaddr_un to = place(topic);
    int64_t stamp = publish(p);
    sendto(sender, &stamp, sizeof stamp, MSG_DONTWAIT, (struct sockaddr *)&to, sizeof to);
}

static void tick(void) {
    if (is("lock")) {
        send_on("/image", &image);
        pause_for(5 * MILLISECOND);
    }
    send_on("/scan", &scan);
}

static void on_image(void) {
    pthread_mutex_lock(&lock);
    pause_for(WORK + 8 * MILLISECOND);
    pthread_mutex_unlock(&lock);
}

static void on_scan(void) {
    if (is("sleeps")) pause_for(WORK);
    else if (is("lock")) pthread_mutex_lock(&lock), pthread_mutex_unlock(&lock);
    else if (is("disk")) write_to_disk(WORK);
    else compute(*problem ? WORK : MILLISECOND);
    send_on("/result", &result);
}

static void on_result(void) {
    compute(MILLISECOND / 5);
}

static long waits(void) {
    struct rusage usage;
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_nvcsw;
}

/* Run a callback, and write down when it began, its CPU time, and how often it waited. */
static void call(handle of, const char *name, void (*callback)(void)) {
    long waited = waits();
    int64_t begin = now(CLOCK_MONOTONIC), cpu = now(CLOCK_THREAD_CPUTIME_ID);
    callback();
    cpu = now(CLOCK_THREAD_CPUTIME_ID) - cpu;
    waited = waits() - waited;
    ros_trace_callback_end(of);
    dprintf(truth, "%s\t%lld\t%lld\t%ld\n", name, (long long)begin, (long long)cpu, waited);
}

static struct heard {
    const char *topic, *name, *function;
    void (*callback)(void);
    int socket;
    struct subscription subscription;
} heard_image = {"/image", "on_image", "Worker::on_image(std_msgs::msg::UInt64 const&)", on_image},
  heard_scan = {"/scan", "on_scan", "Worker::on_scan(std_msgs::msg::UInt64 const&)", on_scan},
  heard_result = {"/result", "on_result", "Sink::on_result(std_msgs::msg::UInt64 const&)", on_result};

static void hear(struct heard *h, int number) {
    struct sockaddr_un at = place(h->topic);
    unlink(at.sun_path);
    h->socket = socket(AF_UNIX, SOCK_DGRAM, 0);
    if (bind(h->socket, (struct sockaddr *)&at, sizeof at)) _exit(1);
    make_subscription(&h->subscription, &node, h->topic, h->function, number);
}

static void *spin(void *of) {
    struct heard *h = of;
    int64_t stamp;
    for (;;) {
        ros_trace_rclcpp_executor_get_next_ready();
        ros_trace_rclcpp_executor_wait_for_work(-1);
        if (recv(h->socket, &stamp, sizeof stamp, 0) < 0) _exit(1);
        take_and_start_callback(&h->subscription, stamp);
        call(&h->subscription.callback, h->name, h->callback);
    }
    return NULL;
}

static void spin_timer(void) {
    int64_t due = now(CLOCK_MONOTONIC);
    for (;;) {
        due += PERIOD;
        ros_trace_rclcpp_executor_get_next_ready();
        ros_trace_rclcpp_executor_wait_for_work(-1);
        sleep_until(due);
        start_timer_callback(&timer);
        call(&timer.callback, "tick", tick);
    }
}

int main(int count, char **words) {
    if (count < 2) return 2;
    const char *process = words[1];
    if (count > 2) problem = words[2];
    signal(SIGINT, SIG_DFL);
    truth = open("truth.tsv", O_WRONLY | O_CREAT | O_APPEND, 0644);
    sender = socket(AF_UNIX, SOCK_DGRAM, 0);
    ros_trace_rcl_init(&context);
    make_node(&node, process);
    pthread_t other;
    struct heard *heard = NULL;
    if (strcmp(process, "sensor") == 0) {
        make_publisher(&image, &node, "/image", 1);
        make_publisher(&scan, &node, "/scan", 2);
        make_timer(&timer, &node, PERIOD, "Sensor::tick()");
    } else if (strcmp(process, "worker") == 0) {
        make_publisher(&result, &node, "/result", 3);
        hear(&heard_image, 1);
        hear(heard = &heard_scan, 2);
        pthread_create(&other, NULL, spin, &heard_image);
    } else {
        hear(heard = &heard_result, 3);
    }
    puts("ready");
    fflush(stdout);
    if (heard) spin(heard);
    spin_timer();
}
