"""The events of the kernel's scheduler, as docs/scheduling.md asks for them."""

from __future__ import annotations

# By the name of LTTng: that of perf.
_NAMES = {
    "sched_switch": "sched:sched_switch",
    "sched_waking": "sched:sched_waking",
    "sched_wakeup_new": "sched:sched_wakeup_new",
    "sched_migrate_task": "sched:sched_migrate_task",
    "sched_process_fork": "sched:sched_process_fork",
    "power_cpu_frequency": "power:cpu_frequency",
    "irq_handler_entry": "irq:irq_handler_entry",
    "irq_handler_exit": "irq:irq_handler_exit",
    "irq_softirq_entry": "irq:softirq_entry",
    "irq_softirq_exit": "irq:softirq_exit",
    "timer_hrtimer_expire_entry": "timer:hrtimer_expire_entry",
    "timer_hrtimer_expire_exit": "timer:hrtimer_expire_exit",
}
KERNEL_EVENTS = tuple(_NAMES)
"""Names of LTTng."""
PERF_EVENTS = tuple(_NAMES.values())
"""Names of perf."""
