tractiond simulation, version 1
# While the publishing thread got no processor, a client subscribed to previews twice, left and connected again. Its end
# counted less than its subscriptions, and previews were made after it had left.
seed 1
lasts 12000 ms
3000 ms: previews 174 for 9000 ms
4300 ms: starved 3 for 600 ms
