-- description: What flows had to wait for, moment by moment: the last step of main.critical_path.
--     It replaces each wait of a flow by the parts of what the flow waited for, and the calls of
--     services in a callback (main.waited_call) by what the service did. Where the kernel was
--     traced, what a thread did is divided into its states (main.schedule_piece).
-- grain: one row per piece of a flow
-- param: parts VARCHAR  Name of the rows of main.end_to_end_part: a table, or a part of the query
-- param: runs, waits, has_kernel, has_calls, has_teams
-- column: run_id, path_id, root_kind, root_id, take_id, latency_ns, flow_rank, hop, position
-- column: part VARCHAR  Part of the flow, as in main.end_to_end_part
-- column: activity, from_ns, to_ns, duration_ns, is_certain, callback_instance_id
-- column: publication_id BIGINT  Message that is published, under way or waited for
-- column: state, wakers, state_thread_id, priority, by_kind, by_thread_id, by_other_thread_id,
--     by_priority, request_id
CREATE OR REPLACE MACRO main.critical_piece(
    parts, runs, waits := 'wait_here', has_kernel := true, has_calls := true, has_teams := true
) AS TABLE
WITH RECURSIVE given AS MATERIALIZED (
    SELECT
        -- Here positions go on from flow to flow.
        * REPLACE (row_number() OVER (ORDER BY latency_ns DESC, flow_id, position) AS position),
        dense_rank() OVER (ORDER BY latency_ns DESC, flow_id) AS flow_rank
    FROM query_table(parts)
),
-- What a server did lies within its call, though its clock or a late event may say otherwise. Of
-- two calls at once the second counts from when the first returned.
waited_call AS MATERIALIZED (
    SELECT
        callback_instance_id, request_id, server_instance_id,
        from_ns AS sent_ns,
        returned_ns,
        CASE WHEN taken_ns IS NOT NULL THEN least(greatest(taken_ns, from_ns), returned_ns) END
            AS taken_ns,
        CASE WHEN start_ns IS NOT NULL
            THEN least(greatest(start_ns, taken_ns, from_ns), returned_ns) END AS start_ns,
        CASE WHEN answered_ns IS NOT NULL
            THEN least(greatest(answered_ns, start_ns, taken_ns, from_ns), returned_ns) END
            AS answered_ns
    FROM (
        SELECT
            *,
            greatest(sent_ns, max(returned_ns) OVER earlier) AS from_ns
        FROM main.waited_call
        WHERE list_contains(runs, run_id)
        WINDOW earlier AS (
            PARTITION BY callback_instance_id ORDER BY sent_ns, request_id
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        )
    ) AS w
    WHERE returned_ns > from_ns
),
-- Calls that callbacks of the flow waited for, and those that their services waited for in turn,
-- each with what goes on when it returns.
call AS (
    SELECT
        g.position, g.part, g.callback_instance_id,
        NULL::BIGINT AS outer_id,
        w.* EXCLUDE (callback_instance_id)
    FROM given AS g
    JOIN waited_call AS w ON g.callback_instance_id = w.callback_instance_id
    WHERE g.part IN ('callback', 'service')
        AND w.sent_ns >= g.from_ns
        AND w.returned_ns <= g.to_ns
    UNION ALL
    SELECT
        c.position, 'service', c.server_instance_id, c.request_id,
        w.* EXCLUDE (callback_instance_id)
    FROM call AS c
    JOIN waited_call AS w ON c.server_instance_id = w.callback_instance_id
    WHERE w.sent_ns >= c.start_ns AND w.returned_ns <= c.answered_ns
),
-- When parts begin. What of a call was not traced is a part of what comes before it.
moment AS (
    SELECT
        position,
        from_ns AS at_ns,
        NULL::BIGINT AS sent_ns,
        part, callback_instance_id,
        NULL::BIGINT AS request_id,
        0 AS place
    FROM given
    UNION ALL
    SELECT position, returned_ns, sent_ns, part, callback_instance_id, outer_id, 5
    FROM call
    WHERE has_calls
    UNION ALL
    SELECT position, at_ns, sent_ns, part, server_instance_id, request_id, place
    FROM (
        SELECT
            position, sent_ns, server_instance_id, request_id,
            unnest([
                {'place': 1, 'part': 'request_to_take',
                    'at_ns': CASE WHEN start_ns IS NOT NULL THEN sent_ns END},
                {'place': 2, 'part': 'take_to_callback',
                    'at_ns': CASE WHEN server_instance_id IS NOT NULL THEN taken_ns END},
                {'place': 3, 'part': 'service', 'at_ns': coalesce(start_ns, sent_ns)},
                {'place': 4, 'part': 'response_to_take', 'at_ns': answered_ns}
            ], recursive := true)
        FROM call
    )
    WHERE has_calls AND at_ns IS NOT NULL
),
part AS MATERIALIZED (
    SELECT
        g.run_id, g.path_id, g.root_kind, g.root_id, g.take_id, g.latency_ns, g.flow_rank, g.hop,
        g.publication_id, m.part, m.callback_instance_id, m.request_id,
        m.at_ns AS from_ns,
        coalesce(lead(m.at_ns) OVER in_time, g.to_ns) AS to_ns,
        row_number() OVER (ORDER BY m.position, m.at_ns, m.sent_ns NULLS FIRST, m.place) AS position
    FROM moment AS m
    JOIN given AS g ON m.position = g.position
    WINDOW in_time AS (PARTITION BY m.position ORDER BY m.at_ns, m.sent_ns NULLS FIRST, m.place)
),
waiting AS MATERIALIZED (
    FROM part
    WHERE part IN ('publish_to_take', 'request_to_take', 'take_to_callback', 'cache')
        AND callback_instance_id IS NOT NULL
        AND to_ns > from_ns
),
-- What ran later tells nothing of them.
waited AS MATERIALIZED (
    SELECT
        x.executor_id,
        max(i.start_ns) AS until_ns
    FROM store.callback_instance AS i
    JOIN store.executor_thread AS x ON i.thread_id = x.thread_id
    WHERE i.callback_instance_id IN (SELECT callback_instance_id FROM waiting)
    GROUP BY x.executor_id
),
wait_here AS NOT MATERIALIZED (FROM derive.callback_ready('waited')),
ready AS MATERIALIZED (
    FROM query_table(waits)
    WHERE callback_instance_id IN (SELECT callback_instance_id FROM waiting)
),
wait AS MATERIALIZED (
    SELECT
        r.callback_instance_id, r.executor_id, r.thread_id, r.callback_id, r.since,
        derive.corrected_ns(r.origin_ns, c) AS origin_ns,
        derive.corrected_ns(coalesce(r.earliest_ns, r.latest_ns), c) AS earliest_ns,
        derive.corrected_ns(r.latest_ns, c) AS latest_ns,
        derive.corrected_ns(r.start_ns, c) AS start_ns,
        r.earliest_ns IS NOT NULL AS is_bounded,
        CASE WHEN r.thread_count = 1 AND NOT r.is_loss_affected
            THEN derive.corrected_ns(greatest(r.earliest_ns, r.previous_wait_end_ns), c) END
            AS away_ns,
        derive.corrected_ns(r.wait_start_ns, c) AS back_ns
    FROM ready AS r
    JOIN store.thread AS t ON r.thread_id = t.thread_id
    JOIN derive.process_clock AS c ON t.process_id = c.process_id
),
meanwhile AS MATERIALIZED (
    SELECT
        w.callback_instance_id, w.executor_id, w.callback_id, w.latest_ns,
        r.callback_instance_id AS meanwhile_id,
        r.callback_id AS meanwhile_callback_id,
        r.thread_id = w.thread_id AS is_own_thread,
        r.process_id,
        greatest(r.start_ns, w.earliest_ns) AS from_ns,
        least(r.end_ns, w.start_ns) AS to_ns
    FROM derive.executor_meanwhile('ready') AS i
    JOIN wait AS w ON i.callback_instance_id = w.callback_instance_id
    JOIN main.callback_instance AS r ON i.meanwhile_id = r.callback_instance_id
    WHERE i.overlap_ns > 0
),
-- Several threads of an executor wait for work one at a time.
several AS (
    SELECT
        executor_id,
        max(start_ns) AS until_ns
    FROM ready
    WHERE thread_count > 1
    GROUP BY executor_id
),
poll AS MATERIALIZED (
    SELECT executor_id, start_ns, end_ns FROM derive.executor_poll('several') WHERE has_teams
),
-- Between two of these waits no thread was free.
held AS MATERIALIZED (
    SELECT
        executor_id, start_ns, end_ns,
        row_number() OVER (PARTITION BY executor_id ORDER BY start_ns) AS number
    FROM (
        SELECT
            executor_id,
            end_ns AS start_ns,
            coalesce(lead(start_ns) OVER in_time, 9223372036854775807) AS end_ns
        FROM poll
        WINDOW in_time AS (PARTITION BY executor_id ORDER BY end_ns)
        UNION ALL
        SELECT
            executor_id, 0,
            min(start_ns)
        FROM poll
        GROUP BY executor_id
    )
),
-- Looked up at both ends: each wait compared with each of these times takes minutes.
held_meanwhile AS (
    SELECT
        r.callback_instance_id, r.executor_id, r.thread_id, r.latest_ns, r.earliest_ns, r.picked_ns,
        unnest(range(f.number, l.number + 1)) AS number
    FROM ready AS r
    ASOF JOIN held AS f ON r.executor_id = f.executor_id AND r.earliest_ns >= f.start_ns
    ASOF JOIN held AS l ON r.executor_id = l.executor_id AND r.picked_ns > l.start_ns
),
-- Nor is one for what a thread has picked.
unserved AS (
    SELECT
        m.callback_instance_id, m.thread_id, m.latest_ns,
        greatest(m.earliest_ns, h.start_ns) AS from_ns,
        least(greatest(m.earliest_ns, m.picked_ns), h.end_ns) AS to_ns
    FROM held_meanwhile AS m
    JOIN held AS h ON m.executor_id = h.executor_id AND m.number = h.number
    WHERE has_teams AND m.earliest_ns < h.end_ns
    UNION ALL
    SELECT
        callback_instance_id, thread_id, latest_ns,
        greatest(earliest_ns, picked_ns),
        start_ns
    FROM ready
    WHERE has_teams AND earliest_ns IS NOT NULL AND executor_id IN (SELECT executor_id FROM poll)
),
-- Of several threads all have to be busy; then the one that took over was, too.
full_house AS (
    SELECT
        b.executor_id,
        derive.corrected_ns(b.start_ns, c) AS start_ns,
        derive.corrected_ns(b.end_ns, c) AS end_ns
    FROM derive.executor_busy AS b
    JOIN (SELECT DISTINCT executor_id, process_id FROM meanwhile) AS p
        ON b.executor_id = p.executor_id
    JOIN derive.process_clock AS c ON p.process_id = c.process_id
    WHERE has_teams AND b.thread_count > 1
),
exclusion AS MATERIALIZED (FROM derive.callback_exclusion WHERE has_teams),
occupied AS (
    SELECT
        m.callback_instance_id, 1 AS priority,
        'executor_busy' AS activity,
        m.from_ns, m.to_ns, m.latest_ns, m.meanwhile_id
    FROM meanwhile AS m
    JOIN derive.executor_size AS s ON m.executor_id = s.executor_id
    WHERE s.thread_count = 1
    UNION ALL
    SELECT
        m.callback_instance_id, 1,
        CASE WHEN m.executor_id IN (SELECT executor_id FROM poll) THEN 'all_threads_busy'
            ELSE 'executor_busy' END,
        greatest(m.from_ns, b.start_ns),
        least(m.to_ns, b.end_ns),
        m.latest_ns, m.meanwhile_id
    FROM meanwhile AS m
    JOIN full_house AS b
        ON m.executor_id = b.executor_id AND m.from_ns < b.end_ns AND m.to_ns > b.start_ns
    WHERE has_teams AND m.is_own_thread
    UNION ALL
    SELECT
        m.callback_instance_id, 2, 'blocked', m.from_ns, m.to_ns, m.latest_ns, m.meanwhile_id
    FROM meanwhile AS m
    JOIN exclusion AS w ON m.callback_id = w.callback_id
    JOIN exclusion AS r
        ON m.meanwhile_callback_id = r.callback_id
        AND w.kind = r.kind
        AND w.exclusion_id = r.exclusion_id
    WHERE has_teams
    UNION ALL
    SELECT
        u.callback_instance_id, 3, 'all_threads_busy',
        derive.corrected_ns(u.from_ns, c),
        derive.corrected_ns(u.to_ns, c),
        derive.corrected_ns(u.latest_ns, c),
        u.callback_instance_id
    FROM unserved AS u
    JOIN store.thread AS t ON u.thread_id = t.thread_id
    JOIN derive.process_clock AS c ON t.process_id = c.process_id
    WHERE has_teams
),
-- The message whose callback published for what lay in the cache, or the timer that did.
completing AS (
    SELECT
        w.position, w.from_ns, w.to_ns, b.publication_id,
        b.start_ns AS published_ns,
        b.end_ns, t.taken_ns, i.callback_instance_id,
        s.callback_instance_id AS publishing_id,
        s.start_ns AS publishing_ns
    FROM waiting AS w
    JOIN main.callback_instance AS i ON w.callback_instance_id = i.callback_instance_id
    JOIN main.take AS t ON i.take_id = t.take_id
    JOIN store.link_transport AS l ON t.take_id = l.take_id
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    LEFT JOIN store.link_causal AS d ON b.publication_id = d.publication_id AND d.kind = 'direct'
    LEFT JOIN main.callback_instance AS s ON d.callback_instance_id = s.callback_instance_id
    WHERE w.part = 'cache'
),
candidate AS (
    SELECT
        w.position, o.priority, o.activity, o.from_ns, o.to_ns, o.latest_ns,
        o.meanwhile_id AS callback_instance_id,
        NULL::BIGINT AS publication_id
    FROM waiting AS w
    JOIN occupied AS o ON w.callback_instance_id = o.callback_instance_id
    WHERE o.priority <= 2 OR w.part <> 'take_to_callback'
    UNION ALL
    SELECT w.position, 4, 'timer', w.from_ns, i.origin_ns, NULL, w.callback_instance_id, NULL
    FROM waiting AS w
    JOIN wait AS i ON w.callback_instance_id = i.callback_instance_id
    WHERE w.part = 'cache' AND i.since = 'timer'
    UNION ALL
    -- Before it is known that the input was there, the executor may have been what it waited for.
    SELECT
        w.position, 5, 'undecided',
        coalesce(c.end_ns, w.from_ns),
        CASE WHEN i.callback_instance_id IS NULL THEN coalesce(c.taken_ns, w.to_ns)
            ELSE least(c.taken_ns, i.latest_ns) END,
        NULL, w.callback_instance_id,
        coalesce(c.publication_id, w.publication_id)
    FROM waiting AS w
    LEFT JOIN completing AS c ON w.position = c.position
    LEFT JOIN wait AS i ON w.callback_instance_id = i.callback_instance_id
    WHERE (w.part IN ('publish_to_take', 'request_to_take') OR c.position IS NOT NULL)
        AND i.is_bounded IS DISTINCT FROM true
    UNION ALL
    -- Nor did it look for input while its one thread did something else for long.
    SELECT w.position, 5, 'undecided', i.away_ns, i.back_ns, NULL, w.callback_instance_id,
        w.publication_id
    FROM waiting AS w
    JOIN wait AS i ON w.callback_instance_id = i.callback_instance_id
    WHERE w.part IN ('publish_to_take', 'request_to_take')
        AND i.is_bounded
        AND i.back_ns - i.away_ns >= 1_000_000
    UNION ALL
    SELECT position, 6, activity, begin_ns, until_ns, NULL, worker_id, publication_id
    FROM (
        SELECT
            position, publication_id,
            unnest([
                {'activity': 'unpublished', 'begin_ns': from_ns,
                    'until_ns': coalesce(publishing_ns, published_ns), 'worker_id': publishing_id},
                {'activity': 'callback', 'begin_ns': publishing_ns, 'until_ns': published_ns,
                    'worker_id': publishing_id},
                {'activity': 'publish', 'begin_ns': published_ns, 'until_ns': end_ns,
                    'worker_id': publishing_id},
                {'activity': 'network_or_idle', 'begin_ns': end_ns, 'until_ns': taken_ns,
                    'worker_id': callback_instance_id},
                {'activity': 'take_to_callback', 'begin_ns': taken_ns, 'until_ns': to_ns,
                    'worker_id': callback_instance_id}
            ], recursive := true)
        FROM completing
    )
    WHERE begin_ns IS NOT NULL
),
named AS (
    SELECT
        p.run_id, p.path_id, p.root_kind, p.root_id, p.take_id, p.latency_ns, p.flow_rank, p.hop,
        p.part, p.position, p.request_id, c.from_ns, c.to_ns,
        CASE
            WHEN c.activity IS NOT NULL THEN c.activity
            WHEN p.part NOT IN ('publish_to_take', 'request_to_take') THEN p.part
            WHEN p.callback_instance_id IS NULL AND p.to_ns > p.from_ns THEN 'undecided'
            ELSE 'network_or_idle'
        END AS activity,
        CASE WHEN c.priority <= 3 THEN coalesce(c.from_ns >= c.latest_ns, false) END AS is_certain,
        CASE WHEN c.activity IS NULL THEN p.callback_instance_id ELSE c.callback_instance_id END
            AS callback_instance_id,
        CASE WHEN c.activity IS NULL THEN p.publication_id ELSE c.publication_id END
            AS publication_id
    FROM derive.flow_piece('part', 'candidate') AS c
    JOIN part AS p ON c.position = p.position
),
-- Neighbours that are the same thing become one.
numbered AS (
    SELECT
        *,
        row_number() OVER (PARTITION BY position ORDER BY from_ns)
        - row_number() OVER (
            PARTITION BY position, activity, is_certain, callback_instance_id, publication_id
            ORDER BY from_ns
        ) AS island
    FROM named
),
whole AS MATERIALIZED (
    SELECT
        run_id, path_id, root_kind, root_id, take_id, latency_ns, flow_rank, hop, part, activity,
        is_certain, callback_instance_id, publication_id, request_id,
        row_number() OVER (ORDER BY position, min(from_ns)) AS interval_id,
        min(from_ns) AS from_ns,
        arg_max(to_ns, from_ns) AS to_ns,
        sum(to_ns - from_ns)::BIGINT AS duration_ns
    FROM numbered
    GROUP BY
        run_id, path_id, root_kind, root_id, take_id, latency_ns, flow_rank, hop, position, part,
        activity, is_certain, callback_instance_id, publication_id, request_id, island
),
owned AS (
    SELECT
        w.*,
        CASE
            WHEN w.activity IN ('publish', 'intra', 'rclcpp', 'rcl', 'rmw', 'dds') THEN p.thread_id
            ELSE i.thread_id
        END AS thread_id
    FROM whole AS w
    LEFT JOIN store.callback_instance AS i ON w.callback_instance_id = i.callback_instance_id
    LEFT JOIN store.publication AS p ON w.publication_id = p.publication_id
),
-- What a thread did for a message without a traced callback ends with what it published, and at the
-- end of the flow with the take. Out of a cache another thread may have published.
interval AS MATERIALIZED (
    SELECT
        w.interval_id, w.from_ns, w.to_ns,
        coalesce(
            w.thread_id,
            nullif(lead(
                CASE WHEN w.part = 'cache' THEN -1 ELSE w.thread_id END IGNORE NULLS
            ) OVER (PARTITION BY w.flow_rank ORDER BY w.interval_id), -1),
            CASE WHEN w.interval_id = max(w.interval_id) OVER (PARTITION BY w.flow_rank)
                THEN t.thread_id END
        ) AS thread_id
    FROM owned AS w
    LEFT JOIN store.take AS t ON w.take_id = t.take_id
    QUALIFY w.activity NOT IN ('cache', 'timer', 'unpublished', 'stored', 'response_to_take')
        AND w.to_ns > w.from_ns
        -- A thread of which nothing is known did the work of a call.
        AND (w.request_id IS NULL OR w.thread_id IS NOT NULL)
)
SELECT
    w.run_id, w.path_id, w.root_kind, w.root_id, w.take_id, w.latency_ns, w.flow_rank, w.hop,
    row_number() OVER (PARTITION BY w.flow_rank ORDER BY w.interval_id, s.from_ns) AS position,
    w.part, w.activity,
    coalesce(s.from_ns, w.from_ns) AS from_ns,
    coalesce(s.to_ns, w.to_ns) AS to_ns,
    coalesce(s.to_ns - s.from_ns, w.duration_ns) AS duration_ns,
    w.is_certain, w.callback_instance_id, w.publication_id, s.state, s.wakers,
    s.thread_id AS state_thread_id,
    s.priority, s.by_kind, s.by_thread_id, s.by_other_thread_id, s.by_priority, w.request_id
FROM whole AS w
LEFT JOIN (FROM main.schedule_piece('interval', runs) WHERE has_kernel) AS s
    ON w.interval_id = s.interval_id AND s.state IS NOT NULL
