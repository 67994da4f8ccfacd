"""The accelerated motion tree, which plans where path following fails.

It keeps braking possible at every vertex, looks ahead at obstacles and inherits tours;
the paper's own method is `guided_tree`. `motion_tree` states a mission for the kernels
and grows trees: groups of vertices and their weights, expansion, safety.
"""
