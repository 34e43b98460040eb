-- kind: inline
-- description: Timers and topics that stopped, and what else began or ended then. Left out is what
--     had to stop: with the timer or the messages that the topic was made of; with the simulated
--     time; where a managed node is not active any more, or a goal of its process ended. A callback
--     without an end is another finding.
-- grain: one row per timer, or publisher
WITH known AS MATERIALIZED (FROM main.series([$run_id])),
silent AS MATERIALIZED (FROM derive.silent_object WHERE run_id = $run_id),
unexplained AS (
    FROM main.stopped_series($run_id) AS t
    -- One that was made anew goes on.
    SEMI JOIN (
        SELECT
            owner,
            max(object_id) AS object_id
        FROM known
        GROUP BY owner, series_id
    ) AS k
        ON t.object_id = k.object_id
        AND k.owner = CASE t.what WHEN 'topic' THEN 'publisher' ELSE 'callback' END
    WHERE t.process_id NOT IN (SELECT process_id FROM derive.hanging_callback)
        AND NOT EXISTS (
            FROM silent AS s
            WHERE s.node_id = t.node_id
                AND s.what <> 'topic'
                AND (t.what = 'topic' OR s.topic_name = '/clock')
                AND s.last_ns BETWEEN t.last_ns - t.near_ns AND t.last_ns
        )
        AND NOT EXISTS (
            FROM main.node_state AS s
            WHERE s.node_id = t.node_id
                AND s.state <> 'active'
                AND abs(s.start_ns - t.at_ns) < t.near_ns
        )
        AND NOT EXISTS (
            FROM main.response AS r
            JOIN main.service AS s ON r.service_id = s.service_id
            WHERE s.process_id = t.process_id
                AND ends_with(s.service_name, '/_action/get_result')
                AND abs(r.sent_ns - t.at_ns) < t.near_ns
        )
        -- All who heard it ended then.
        AND NOT coalesce(
            (
                SELECT max(p.last_seen_ns)
                FROM main.subscription AS s
                JOIN main.process AS p ON s.process_id = p.process_id
                WHERE t.what = 'topic' AND s.run_id = t.run_id AND s.topic_name = t.topic_name
            ) BETWEEN t.at_ns - t.near_ns AND t.at_ns + t.near_ns,
            false
        )
),
beside AS (
    SELECT
        t.what, t.object_id,
        array_to_string(
            list(
                o.sentence
                ORDER BY
                    list_contains(o.nodes, n.full_name) DESC, abs(o.at_ns - t.at_ns), o.sentence
            )[:3],
            '; '
        ) AS sentences
    FROM unexplained AS t
    JOIN main.occasion([$run_id], 'known') AS o ON abs(o.at_ns - t.at_ns) < t.near_ns
    LEFT JOIN main.node AS n ON t.node_id = n.node_id
    GROUP BY t.what, t.object_id
)
SELECT
    t.run_id, t.what, t.node_id, t.topic_name, t.at_ns, t.count,
    coalesce(
        l.node || ' ' || l.label,
        t.topic_name || coalesce(' of ' || n.full_name, '')
    ) AS subject,
    printf(
        'each %s, then %s missing%s; %s', main.duration_text(t.usual_ns),
        derive.counted(t.count, 'time'),
        coalesce(
            ', and with it ' || (
                SELECT string_agg(s.topic_name, ', ' ORDER BY s.topic_name)
                FROM silent AS s
                WHERE t.what = 'timer' AND s.what = 'topic'
                    AND s.node_id = t.node_id
                    AND s.last_ns BETWEEN t.last_ns AND t.last_ns + t.near_ns
            ),
            ''
        ),
        coalesce(
            printf('within %s: %s', main.duration_text(t.near_ns), b.sentences),
            'nothing else is seen to begin or end then'
        )
    ) AS sentence
FROM unexplained AS t
LEFT JOIN main.node AS n ON t.node_id = n.node_id
LEFT JOIN beside AS b ON t.what = b.what AND t.object_id = b.object_id
LEFT JOIN main.callback_label AS l ON t.what = 'timer' AND t.object_id = l.callback_id
