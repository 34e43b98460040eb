-- title: End-to-end latency between two topics
-- description: How long it took from the start of a flow (as for e2e-latency) to its end at a node,
--     over all paths between the topic of its first message and that of its last one. The first
--     arrival of a root says how soon the end reacted to it, its last one how long it had an
--     effect. The newest root that an arrival reflects says how old the data were. Give --from and
--     --to: else there is a row for each two topics between which a path leads.
-- grain: one row per topic where flows start, topic where they end, and node that takes it
-- reads: path_outcome, named_path
-- param: from, to, from_event, to_event, max_depth, max_paths
-- column: run_id, first_topic, last_topic
-- column: node VARCHAR [node]  Node that takes it
-- column: paths BIGINT             Paths between them
-- column: roots
-- column: reached BIGINT           Roots that arrived, by any path
-- column: superseded BIGINT        Others, replaced by a newer input before they were used
-- column: dropped BIGINT           Others, that ended in a full queue
-- column: lost BIGINT              Others, that were lost on the way
-- column: no_output BIGINT         Others, that ended at a node that did not publish
-- column: not_connected BIGINT     Others, that ended before or after a publisher and a
--     subscription were connected
-- column: unknown BIGINT           Others, that end where the trace does not show
-- column: cut_by_recording BIGINT  Others, too close to the start or end of the recording to know
-- column: loss_affected
-- column: ambiguous BIGINT         Pairs of root and arrival that no path leads to without a link
--     that may be another one (a candidate_count above 1)
-- column: messages BIGINT          Messages at the end that reflect a root
-- column: pairs BIGINT             Pairs of root and arrival whose latency is known
-- column: per_root DOUBLE         Messages that reflect a root which arrived, on average
-- column: roots_by_messages VARCHAR  Of the roots that arrived, how many became how many messages
--     at the end: '1: 25, 3: 110' are 25 with one message and 110 with three
-- column: first_min_ns BIGINT [ns]     Latency of the first arrival of each root: the shortest
-- column: first_median_ns BIGINT [ns]  Its median
-- column: first_mean_ns BIGINT [ns]    Its mean
-- column: first_p95_ns BIGINT [ns]     95 % are at most this
-- column: first_p99_ns BIGINT [ns]     99 % are at most this
-- column: first_max_ns BIGINT [ns]     The longest
-- column: first_max_root_ns BIGINT [epoch ns]  When the flow with the longest one began
-- column: first_max_take_id BIGINT     Take at its end: msgflow flow --take
-- column: last_min_ns BIGINT [ns]      Latency of the last arrival of each root: the shortest
-- column: last_median_ns BIGINT [ns]   Its median
-- column: last_mean_ns BIGINT [ns]     Its mean
-- column: last_p95_ns BIGINT [ns]      95 % are at most this
-- column: last_p99_ns BIGINT [ns]      99 % are at most this
-- column: last_max_ns BIGINT [ns]      The longest
-- column: last_max_root_ns BIGINT [epoch ns]  When the flow with the longest one began
-- column: last_max_take_id BIGINT      Take at its end: msgflow flow --take
-- column: newest_median_ns BIGINT [ns]  Age of the newest root of each arrival: its median
-- column: newest_mean_ns BIGINT [ns]   Its mean
-- column: newest_p95_ns BIGINT [ns]    95 % are at most this
-- column: newest_p99_ns BIGINT [ns]    99 % are at most this
-- column: newest_max_ns BIGINT [ns]    The highest
-- column: is_cut BOOLEAN           There may be more paths, beyond max_depth or max_paths
-- brief: first_topic, last_topic, node, first_median_ns, last_max_ns, reached (even 0), lost,
--     ambiguous, loss_affected, dropped, newest_max_ns, per_root, roots, first_max_ns,
--     last_median_ns, newest_median_ns, first_p95_ns, last_p95_ns, newest_p95_ns, paths,
--     superseded, no_output, not_connected, unknown, cut_by_recording, roots_by_messages
-- note: clocks
WITH flow AS (
    SELECT
        p.path,
        p.topics[1] AS first_topic,
        p.topics[-1] AS last_topic,
        e.run_id, e.root_kind, e.root_id, e.root_ns, e.take_id, e.sink_ns, e.latency_ns, e.status,
        e.is_loss_affected, e.is_ambiguous
    FROM path_outcome AS e
    JOIN named_path AS p ON e.path_id = p.path_id
),
arrival AS MATERIALIZED (
    SELECT
        *,
        CASE WHEN is_first THEN latency_ns END AS first_ns,
        CASE WHEN is_last THEN latency_ns END AS last_ns,
        CASE WHEN is_newest THEN latency_ns END AS newest_ns,
        count(take_id) OVER (
            PARTITION BY run_id, first_topic, last_topic, node, root_kind, root_id
        ) AS root_messages
    FROM main.end_to_end_between('flow')
),
measured AS (
    SELECT
        run_id, first_topic, last_topic, node,
        histogram(CASE WHEN is_first IS NOT false THEN status END)::MAP(VARCHAR, BIGINT) AS number,
        count(*) FILTER (WHERE is_first IS NOT false) AS roots,
        count(DISTINCT (root_kind, root_id)) FILTER (is_loss_affected) AS loss_affected,
        count(*) FILTER (WHERE is_ambiguous) AS ambiguous,
        count(DISTINCT take_id) AS messages,
        count(latency_ns) AS pairs,
        count(take_id) AS arrivals,
        map_entries(histogram(root_messages) FILTER (WHERE is_first AND take_id IS NOT NULL))
            AS root_counts,
        main.spread(first_ns) AS firsts,
        -- Of equally long ones the first, and of its arrivals the first.
        max(struct_pack(latency_ns := first_ns, before_ns := -root_ns, before_take := -take_id))
            FILTER (WHERE first_ns IS NOT NULL) AS longest_first,
        main.spread(last_ns) AS lasts,
        max(struct_pack(latency_ns := last_ns, before_ns := -root_ns, before_take := -take_id))
            FILTER (WHERE last_ns IS NOT NULL) AS longest_last,
        main.spread(newest_ns) AS newests
    FROM arrival
    GROUP BY run_id, first_topic, last_topic, node
),
ends AS (
    SELECT
        run_id,
        topics[1] AS first_topic,
        topics[-1] AS last_topic,
        string_split(path, ' → ')[-1] AS node,
        count(*) AS paths,
        bool_or(is_cut) AS is_cut
    FROM named_path
    GROUP BY ALL
)
SELECT
    n.run_id, n.first_topic, n.last_topic, n.node, n.paths,
    coalesce(m.roots, 0) AS roots,
    coalesce(m.number['reached'], 0) AS reached,
    coalesce(m.number['superseded'], 0) AS superseded,
    coalesce(m.number['dropped'], 0) AS dropped,
    coalesce(m.number['lost'], 0) AS lost,
    coalesce(m.number['no_output'], 0) AS no_output,
    coalesce(m.number['not_connected'], 0) AS not_connected,
    coalesce(m.number['unknown'], 0) AS unknown,
    coalesce(m.number['cut_by_recording'], 0) AS cut_by_recording,
    coalesce(COLUMNS(['loss_affected', 'ambiguous', 'messages', 'pairs']), 0),
    round(m.arrivals / nullif(m.number['reached'], 0), 2) AS per_root,
    array_to_string(
        [printf('%d: %d', each.key, each.value) FOR each IN m.root_counts], ', '
    ) AS roots_by_messages,
    m.firsts.min_ns AS first_min_ns,
    m.firsts.median_ns AS first_median_ns,
    m.firsts.mean_ns AS first_mean_ns,
    m.firsts.p95_ns AS first_p95_ns,
    m.firsts.p99_ns AS first_p99_ns,
    m.firsts.max_ns AS first_max_ns,
    -m.longest_first.before_ns AS first_max_root_ns,
    -m.longest_first.before_take AS first_max_take_id,
    m.lasts.min_ns AS last_min_ns,
    m.lasts.median_ns AS last_median_ns,
    m.lasts.mean_ns AS last_mean_ns,
    m.lasts.p95_ns AS last_p95_ns,
    m.lasts.p99_ns AS last_p99_ns,
    m.lasts.max_ns AS last_max_ns,
    -m.longest_last.before_ns AS last_max_root_ns,
    -m.longest_last.before_take AS last_max_take_id,
    m.newests.median_ns AS newest_median_ns,
    m.newests.mean_ns AS newest_mean_ns,
    m.newests.p95_ns AS newest_p95_ns,
    m.newests.p99_ns AS newest_p99_ns,
    m.newests.max_ns AS newest_max_ns,
    n.is_cut
FROM ends AS n
LEFT JOIN measured AS m
    ON n.run_id = m.run_id
    AND n.first_topic IS NOT DISTINCT FROM m.first_topic
    AND n.last_topic IS NOT DISTINCT FROM m.last_topic
    AND n.node = m.node
ORDER BY n.run_id, n.first_topic, n.last_topic, n.node
