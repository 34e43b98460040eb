-- name: main.critical_path
-- kind: macro
-- description: What one flow had to wait for, moment by moment: its parts (main.end_to_end_part),
--     with waits replaced by what they waited for, as far as the trace shows. Before a callback:
--     what its executor was busy with, or what excludes the callback. In a cache: the timer until
--     it was due, or the message that completed the set, from the callback that published it. Where
--     the kernel was traced, what a thread did is divided into its states. The pieces add up to the
--     latency. A negative part is one piece.
-- grain: one row per piece of the flow
-- param: runs BIGINT[]  Runs to look at
-- param: from_topic VARCHAR = NULL  Topics or nodes where flows start: names or globs, separated by
--     commas; NULL: any
-- param: to_topic VARCHAR = NULL  Topics or nodes where flows end, in the same form; NULL: any
-- param: from_event VARCHAR = 'callback_start'  Event that starts the clock: 'callback_start' or
--     'publish'; others are an error
-- param: to_event VARCHAR = 'callback_end'  Event that stops it: 'take', 'callback_start' or
--     'callback_end'; others are an error
-- param: window_start_ns BIGINT = NULL  Start of the time window of roots, epoch ns; NULL: any
-- param: window_end_ns BIGINT = NULL  End of the time window of roots, epoch ns, exclusive;
--     NULL: any
-- param: sink_take_id BIGINT = NULL  Only flows that end with this take; NULL: all
-- param: max_depth INTEGER = 32  Longest chain, in topics
-- param: max_paths INTEGER = 1000  Maximum number of paths, shortest first; also the limit on
--     chains of each length
-- param: most_flows INTEGER = 1  How many of the longest flows
-- param: at_quantile DOUBLE = NULL  In their place the flow with this quantile of the latency,
--     0 to 1
-- param: path_ids BIGINT[] = NULL  Only flows of these paths; NULL: all
-- param: flow_case VARCHAR = 'first'  Pairs of root and arrival that count: 'first', 'last',
--     'newest' or 'every_pair'
-- column: run_id BIGINT  Run
-- column: path_id BIGINT  Path, as main.flow_path numbers it for the same arguments
-- column: root_kind VARCHAR  'callback_instance', 'publication' or 'take'
-- column: root_id BIGINT  Identity of the root
-- column: take_id BIGINT  Take at the end of the path
-- column: latency_ns BIGINT [ns]  From the start of the root to the end
-- column: flow_rank BIGINT  Number of the flow, the longest first
-- column: hop BIGINT  Number of the message on the path that it belongs or leads to
-- column: position BIGINT  Order within the flow, from 1
-- column: part VARCHAR  Part of the flow, as in main.end_to_end_part
-- column: activity VARCHAR  What happened: the part itself; up to a take 'network_or_idle',
--     'executor_busy' (it ran something else), 'all_threads_busy', 'blocked' (a callback ran that
--     excludes the waiting one) or 'undecided' (nothing shows when the message arrived); in a cache
--     'timer' (not due yet), 'unpublished' (the message that was waited for), or a part of that
--     message's own flow
-- column: from_ns BIGINT [epoch ns]  Begin
-- column: to_ns BIGINT [epoch ns]  End
-- column: duration_ns BIGINT [ns]  to_ns - from_ns
-- column: is_certain BOOLEAN  For 'executor_busy', 'all_threads_busy' and 'blocked': what waited
--     was ready by then; false: it may have arrived meanwhile. NULL for others
-- column: callback_instance_id BIGINT  Callback instance that it is, or that it waits for
-- column: publication_id BIGINT  Message that is published, under way or waited for
-- column: state VARCHAR  State of the thread, as in main.schedule_piece; NULL: not traced by the
--     kernel, or no thread's doing
-- column: wakers BIGINT  How many wakers lead to the thread: 0 for the one that the piece is of
-- column: state_thread_id BIGINT  The thread in that state
-- column: priority INTEGER  Its priority, as the kernel has it: 0 to 99 real-time, 100 to 139 nice
-- column: by_kind VARCHAR  What took the CPU, or ended the sleep: 'thread', 'timer', 'interrupt' or
--     'softirq'. NULL: not known, or the state needs none
-- column: by_thread_id BIGINT  That thread, of a ROS process
-- column: by_other_thread_id BIGINT  That thread, of another process
-- column: by_priority INTEGER  Its priority; known for what took the CPU
CREATE OR REPLACE MACRO main.critical_path(
    runs, from_topic := NULL, to_topic := NULL, from_event := 'callback_start',
    to_event := 'callback_end', window_start_ns := NULL, window_end_ns := NULL,
    sink_take_id := NULL, max_depth := 32, max_paths := 1000, most_flows := 1, at_quantile := NULL,
    path_ids := NULL, flow_case := 'first'
) AS TABLE
WITH flow_part AS MATERIALIZED (
    SELECT
        flow_id, run_id, path_id, root_kind, root_id, take_id, latency_ns, hop, position, part,
        from_ns, to_ns, duration_ns, callback_instance_id, publication_id
    FROM main.end_to_end_part(
        runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns,
        flow_case, sink_take_id := sink_take_id, max_depth := max_depth, max_paths := max_paths,
        most_flows := most_flows, at_quantile := at_quantile, path_ids := path_ids
    )
)
SELECT
    run_id, path_id, root_kind, root_id, take_id, latency_ns, flow_rank, hop, position, part,
    activity, from_ns, to_ns, duration_ns, is_certain, callback_instance_id, publication_id,
    state, wakers, state_thread_id, priority, by_kind, by_thread_id, by_other_thread_id, by_priority
FROM main.critical_piece('flow_part', runs)
