-- title: Topics whose messages come in bursts
-- description: Most messages follow the one before in less than a tenth of their mean period.
-- grain: one row per topic
-- reads: callback_name, harm
-- column: topic_name VARCHAR  The topic
-- column: node VARCHAR  Node that publishes
-- column: callback VARCHAR  What triggers the callback that publishes; NULL: none is known
-- column: function VARCHAR  Its function
-- column: size BIGINT  Messages of the largest burst
-- column: period_ns BIGINT [ns]  Median time from one burst to the next
-- column: is_one_root BOOLEAN  One run of the callback sends all of it
WITH message AS (
    SELECT
        p.topic_name, p.publisher_id, b.publication_id, b.start_ns,
        b.start_ns - lag(b.start_ns) OVER in_time AS gap_ns,
        (max(b.start_ns) OVER each - min(b.start_ns) OVER each)
        / nullif(count(*) OVER each - 1, 0) AS mean_ns
    FROM main.publication AS b
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE list_contains($runs, b.run_id)
        AND p.topic_name IN (SELECT topic_name FROM harm WHERE matters AND own_ns > direct_ns)
        AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
    WINDOW
        each AS (PARTITION BY p.publisher_id),
        in_time AS (PARTITION BY p.publisher_id ORDER BY b.start_ns, b.publication_id)
),
burst AS (
    SELECT
        topic_name, publisher_id, number,
        min(start_ns) AS start_ns,
        count(*) AS size,
        min(publication_id) AS publication_id
    FROM (
        SELECT
            *,
            count(*) FILTER (WHERE gap_ns IS NULL OR gap_ns >= 0.1 * mean_ns) OVER (
                PARTITION BY publisher_id ORDER BY start_ns, publication_id
            ) AS number
        FROM message
    )
    GROUP BY topic_name, publisher_id, number
),
following AS (
    SELECT
        *,
        start_ns - lag(start_ns) OVER (PARTITION BY publisher_id ORDER BY start_ns) AS period_ns
    FROM burst
),
topic AS (
    SELECT
        topic_name,
        arg_max(publisher_id, size) AS publisher_id,
        max(size) AS size,
        arg_max(publication_id, size) AS publication_id,
        quantile_disc(period_ns, 0.5)::BIGINT AS period_ns
    FROM following
    GROUP BY topic_name
    HAVING count(*) < 0.5 * sum(size)
)
SELECT
    t.topic_name,
    main.node_label(n.full_name, r.name, r.pid) AS node,
    k.callback, k.function, t.size, t.period_ns,
    coalesce(t.size <= o.number, false) AS is_one_root
FROM topic AS t
JOIN main.publisher AS p ON t.publisher_id = p.publisher_id
JOIN main.process AS r ON p.process_id = r.process_id
LEFT JOIN main.node AS n ON p.node_id = n.node_id
LEFT JOIN main.link_causal AS c ON t.publication_id = c.publication_id AND c.kind = 'direct'
LEFT JOIN (
    SELECT
        l.callback_instance_id, b.publisher_id,
        count(*) AS number
    FROM main.link_causal AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    WHERE list_contains($runs, l.run_id) AND l.kind = 'direct'
    GROUP BY l.callback_instance_id, b.publisher_id
) AS o
    ON c.callback_instance_id = o.callback_instance_id AND t.publisher_id = o.publisher_id
LEFT JOIN main.callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
LEFT JOIN callback_name AS k ON i.callback_id = k.callback_id
