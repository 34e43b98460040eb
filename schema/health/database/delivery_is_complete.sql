-- title: Messages are counted twice, or not at all
-- description: Every take has a publication or a reason, and every message was taken by each
--     subscription of its topic or has a reason: published times subscriptions is what was
--     delivered and what was not. Placeholders for readers of ring buffers do not count, nor
--     do those that only get copies of what these carry.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run and topic, or run, for which the sums differ
-- severity: error
WITH publisher AS (
    SELECT
        p.run_id, p.publisher_id,
        derive.own_topic(p.topic_name, p.is_agnocast, c.clock_id) AS topic_name
    FROM store.publisher AS p
    JOIN derive.process_clock AS c ON p.process_id = c.process_id
),
published AS (
    SELECT
        p.run_id, p.topic_name,
        count(*) AS number
    FROM store.publication AS b
    JOIN publisher AS p ON b.publisher_id = p.publisher_id
    WHERE p.topic_name IS NOT NULL
    GROUP BY p.run_id, p.topic_name
),
subscription AS (
    SELECT
        s.run_id, s.subscription_id,
        derive.own_topic(s.topic_name, s.is_agnocast, c.clock_id) AS topic_name
    FROM store.subscription AS s
    JOIN derive.process_clock AS c ON s.process_id = c.process_id
    WHERE NOT coalesce(s.is_inferred AND s.rmw_handle IS NULL, false)
),
subscribed AS (
    SELECT
        run_id, topic_name,
        count(*) AS number
    FROM subscription
    WHERE topic_name IS NOT NULL
    GROUP BY run_id, topic_name
),
delivered AS (
    SELECT
        s.run_id, s.topic_name,
        count(*) AS number
    FROM (
        SELECT DISTINCT publication_id, publisher_id, subscription_id
        FROM store.link_transport
        WHERE is_copy IS NOT TRUE
    ) AS l
    JOIN publisher AS p ON l.publisher_id = p.publisher_id
    JOIN subscription AS s ON l.subscription_id = s.subscription_id
    WHERE p.topic_name = s.topic_name
    GROUP BY s.run_id, s.topic_name
),
not_judged AS (
    SELECT
        p.run_id, p.topic_name,
        count(*) AS number
    FROM derive.copied_pair AS c
    JOIN publisher AS p ON c.publisher_id = p.publisher_id
    JOIN subscription AS s ON c.subscription_id = s.subscription_id AND p.topic_name = s.topic_name
    JOIN store.publication AS b ON c.publisher_id = b.publisher_id
    ANTI JOIN (SELECT * FROM store.link_transport WHERE is_copy IS NOT TRUE) AS l
        ON b.publication_id = l.publication_id AND c.subscription_id = l.subscription_id
    GROUP BY p.run_id, p.topic_name
),
undelivered AS (
    SELECT
        s.run_id, s.topic_name,
        count(*) AS number
    FROM store.undelivered AS u
    JOIN subscription AS s ON u.subscription_id = s.subscription_id
    GROUP BY s.run_id, s.topic_name
),
taken AS (
    SELECT
        run_id,
        count(*) AS number
    FROM store.take
    GROUP BY run_id
),
linked AS (
    SELECT
        run_id,
        count(DISTINCT take_id) AS number
    FROM store.link_transport
    GROUP BY run_id
),
orphan AS (
    SELECT
        run_id,
        count(DISTINCT take_id) AS number
    FROM store.orphan_take
    GROUP BY run_id
)
SELECT
    b.run_id,
    b.topic_name AS subject,
    1 AS count,
    printf(
        '%d messages for subscriptions; %d delivered, or with a reason',
        b.number * s.number - coalesce(n.number, 0),
        coalesce(d.number, 0) + coalesce(u.number, 0)
    ) AS detail
FROM published AS b
JOIN subscribed AS s ON b.run_id = s.run_id AND b.topic_name = s.topic_name
LEFT JOIN delivered AS d ON b.run_id = d.run_id AND b.topic_name = d.topic_name
LEFT JOIN undelivered AS u ON b.run_id = u.run_id AND b.topic_name = u.topic_name
LEFT JOIN not_judged AS n ON b.run_id = n.run_id AND b.topic_name = n.topic_name
WHERE b.number * s.number - coalesce(n.number, 0) <> coalesce(d.number, 0) + coalesce(u.number, 0)
UNION ALL
SELECT
    t.run_id,
    'takes',
    1,
    printf(
        '%d takes; %d with a publication, or a reason',
        t.number, coalesce(l.number, 0) + coalesce(o.number, 0)
    )
FROM taken AS t
LEFT JOIN linked AS l ON t.run_id = l.run_id
LEFT JOIN orphan AS o ON t.run_id = o.run_id
WHERE t.number <> coalesce(l.number, 0) + coalesce(o.number, 0)
